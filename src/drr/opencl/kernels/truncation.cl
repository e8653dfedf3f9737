// What the CT cannot explain: where a ray leaves the volume through a cut face, the face's tissue is taken to go on
// without end, and its line integral U tells how much of the X-ray has no CT behind it; weight 1 / (1 + (U / limit)²),
// so that nothing jumps. Seen at the points of a coarse map over the image, LANES of them by each work-item.

#define MAP_STEPS 96

// The part of a ray, in steps of it, that lies behind no face but cut ones: beside the body there is air. By axis, the
// steps between which the ray is above `low` and below `high`.
#define CLIP_STEPS(at, slope, low, high, cut_low, cut_high)                                            \
  {                                                                                                    \
    const float inv_slope = 1.0f / away_from_zero(slope);                                              \
    const float to_low = ((low) - (at)) * inv_slope, to_high = ((high) - (at)) * inv_slope;            \
    const float enters = inv_slope > 0.0f ? ((cut_low) ? -1e9f : to_low) : ((cut_high) ? -1e9f : to_high); \
    const float leaves = inv_slope > 0.0f ? ((cut_high) ? 1e9f : to_high) : ((cut_low) ? 1e9f : to_low);   \
    begin = fmax(begin, enters);                                                                       \
    end = fmin(end, leaves);                                                                           \
  }

__kernel void unexplained(__global const uint* volume, const Grid grid, __global const float* pose, const int map_width,
                          const int map_height, const int cut_faces, const float radius_voxels,
                          const float limit, __global float* map) {
  const int first_point = get_global_id(0) * LANES;
  const int points = map_width * map_height;
  if (first_point >= points) return;
  const int low = PADDING;  // First voxel of the box behind its padding.
  const int3 high = (int3)(grid.size_x, grid.size_y, grid.size_z) - 1 - PADDING;
  // Voxel at step s, and what the sum of steps is worth.
  float x0[LANES], y0[LANES], z0[LANES], dx[LANES], dy[LANES], dz[LANES], worth[LANES], total[LANES];
  float first_step = (float)MAP_STEPS, last_step = -1.0f;
  for (int r = 0; r < LANES; ++r) {
    const int i = min(first_point + r, points - 1);
    const float u = (float)(i % map_width) * (float)MAP_STEP - pose[P_MID_U];
    const float v = (float)(i / map_width) * (float)MAP_STEP - pose[P_MID_V];
    const float3 direction = (float3)(linear(pose + P_DIRECTION, u, v), linear(pose + P_DIRECTION + 3, u, v),
                                      linear(pose + P_DIRECTION + 6, u, v));
    const float3 source = (float3)(pose[P_SOURCE], pose[P_SOURCE + 1], pose[P_SOURCE + 2]);
    const float inv_length = 1.0f / length(direction);
    const float d_x = (u - pose[P_CX]) * pose[P_INV_FX], d_y = (v - pose[P_CY]) * pose[P_INV_FY];
    const float mm_per_voxel = sqrt(d_x * d_x + d_y * d_y + 1.0f) * inv_length;
    // From where the ray is nearest to the box centre, one radius to both sides.
    const float nearest = -dot(source, direction) * inv_length * inv_length;
    const float near_end = fmax(nearest - radius_voxels * inv_length, 0.0f);
    const float far_end = fmax(nearest + radius_voxels * inv_length, 0.0f);
    const float step = (far_end - near_end) / (float)MAP_STEPS;
    // Half a voxel more: a voxel is the nearest one.
    const float at = near_end + 0.5f * step;
    x0[r] = fma(at, direction.x, source.x) + grid.centre_x + 0.5f;
    y0[r] = fma(at, direction.y, source.y) + grid.centre_y + 0.5f;
    z0[r] = fma(at, direction.z, source.z) + grid.centre_z + 0.5f;
    dx[r] = step * direction.x;
    dy[r] = step * direction.y;
    dz[r] = step * direction.z;
    worth[r] = step / inv_length * mm_per_voxel * pose[P_SCALE];
    total[r] = 0.0f;
    float begin = 0.0f, end = (float)(MAP_STEPS - 1);
    CLIP_STEPS(x0[r], dx[r], (float)low, (float)(high.x + 1), cut_faces & 1, cut_faces & 2)
    CLIP_STEPS(y0[r], dy[r], (float)low, (float)(high.y + 1), cut_faces & 4, cut_faces & 8)
    CLIP_STEPS(z0[r], dz[r], (float)low, (float)(high.z + 1), cut_faces & 16, cut_faces & 32)
    first_step = begin <= end + 1.0f ? fmin(first_step, begin - 1.0f) : first_step;
    last_step = begin <= end + 1.0f ? fmax(last_step, end + 1.0f) : last_step;
  }
  const int first = max((int)first_step, 0), last = min((int)last_step, MAP_STEPS - 1);
  for (int s = first; s <= last; ++s) {
    WIDE_VECTORS
    for (int r = 0; r < LANES; ++r) {
      const float t = (float)s;
      const float x = floor(fma(t, dx[r], x0[r])), y = floor(fma(t, dy[r], y0[r])), z = floor(fma(t, dz[r], z0[r]));
      const int at_x = (int)clamp(x, -1.0f, 1e6f), at_y = (int)clamp(y, -1.0f, 1e6f), at_z = (int)clamp(z, -1.0f, 1e6f);
      const int outside = (at_x < low ? 1 : 0) | (at_x > high.x ? 2 : 0) | (at_y < low ? 4 : 0) |
                          (at_y > high.y ? 8 : 0) | (at_z < low ? 16 : 0) | (at_z > high.z ? 32 : 0);
      // Behind cut faces alone the body goes on; beside the body there is air.
      const int counts = (outside != 0) & ((outside & ~cut_faces) == 0);
      const int index = (clamp(at_z, low, high.z) * grid.size_y + clamp(at_y, low, high.y)) * grid.size_x +
                        clamp(at_x, low, high.x);
      total[r] += counts ? LOW(volume[index]) : 0.0f;
    }
  }
  for (int r = 0; r < LANES; ++r) {
    const float ratio = total[r] * worth[r] / limit;
    if (first_point + r < points) map[first_point + r] = 1.0f / (1.0f + ratio * ratio);
  }
}

// weight = mask · map, the map interpolated between its points; below a twentieth it is nothing. LANES pixels of one row
// by each work-item.
__kernel void apply_map(__global const float* mask, __global const float* map, const int width, const int height,
                        const int map_width, const int map_height, __global float* weight) {
  const int chunks = (width + LANES - 1) / LANES;
  const int row = get_global_id(0) / chunks, first = get_global_id(0) % chunks * LANES;
  if (row >= height) return;
  const float y = fmin((float)row / (float)MAP_STEP, (float)(map_height - 1) - 0.001f);
  const int iy = (int)y;
  const float fy = y - (float)iy;
  __global const float* above = map + iy * map_width;
  __global const float* below = above + map_width;
  float factor[LANES];
  for (int r = 0; r < LANES; ++r) {
    const float x = fmin((float)(first + r) / (float)MAP_STEP, (float)(map_width - 1) - 0.001f);
    const int ix = (int)x;
    const float fx = x - (float)ix;
    const float w = mix(mix(above[ix], above[ix + 1], fx), mix(below[ix], below[ix + 1], fx), fy);
    factor[r] = w < 0.05f ? 0.0f : w;
  }
  const int count = min(LANES, width - first);
  for (int r = 0; r < count; ++r) weight[row * width + first + r] = mask[row * width + first + r] * factor[r];
}

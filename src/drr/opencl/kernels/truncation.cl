// What the CT cannot explain: where a ray leaves the volume through a cut face, the face's tissue is taken to go on
// without end, and its line integral U tells how much of the X-ray has no CT behind it. One work-item per point of a
// coarse map over the image; weight 1 / (1 + (U / limit)²), so that nothing jumps.
__kernel void unexplained(__global const uint* volume, const Grid grid, __global const float* pose, const int map_width,
                          const int map_height, const int cut_faces, const float radius_voxels,
                          const float limit, __global float* map) {
  const int i = get_global_id(0);
  if (i >= map_width * map_height) return;
  const float u = (float)(i % map_width) * (float)MAP_STEP - pose[P_MID_U];
  const float v = (float)(i / map_width) * (float)MAP_STEP - pose[P_MID_V];
  const float3 direction = (float3)(linear(pose + P_DIRECTION, u, v), linear(pose + P_DIRECTION + 3, u, v),
                                    linear(pose + P_DIRECTION + 6, u, v));
  const float3 source = (float3)(pose[P_SOURCE], pose[P_SOURCE + 1], pose[P_SOURCE + 2]);
  const float3 centre = (float3)(grid.centre_x, grid.centre_y, grid.centre_z);
  const float inv_length = 1.0f / length(direction);
  const float d_x = (u - pose[P_CX]) * pose[P_INV_FX], d_y = (v - pose[P_CY]) * pose[P_INV_FY];
  const float mm_per_voxel = sqrt(d_x * d_x + d_y * d_y + 1.0f) * inv_length;
  // From where the ray is nearest to the box centre, one radius to both sides.
  const float nearest = -dot(source, direction) * inv_length * inv_length;
  const float first = fmax(nearest - radius_voxels * inv_length, 0.0f);
  const float last = fmax(nearest + radius_voxels * inv_length, 0.0f);
  const int steps = 96;
  const float step = (last - first) / (float)steps;
  const int low = PADDING;  // First voxel of the box behind its padding.
  const int3 high = (int3)(grid.size_x, grid.size_y, grid.size_z) - 1 - PADDING;
  float total = 0.0f;
  for (int s = 0; s < steps; ++s) {
    const float3 p = source + (first + ((float)s + 0.5f) * step) * direction + centre;
    const int3 at = convert_int3_rtn(p + 0.5f);
    const int below_x = at.x < low, above_x = at.x > high.x;
    const int below_y = at.y < low, above_y = at.y > high.y;
    const int below_z = at.z < low, above_z = at.z > high.z;
    const int outside = (below_x ? 1 : 0) | (above_x ? 2 : 0) | (below_y ? 4 : 0) | (above_y ? 8 : 0) |
                        (below_z ? 16 : 0) | (above_z ? 32 : 0);
    // Behind cut faces alone the body goes on; beside the body there is air.
    const int counts = outside != 0 && (outside & ~cut_faces) == 0;
    const int index = (clamp(at.z, low, high.z) * grid.size_y + clamp(at.y, low, high.y)) * grid.size_x +
                      clamp(at.x, low, high.x);
    total += counts ? LOW(volume[index]) : 0.0f;
  }
  const float integral = total * step / inv_length * mm_per_voxel * pose[P_SCALE];
  const float ratio = integral / limit;
  map[i] = 1.0f / (1.0f + ratio * ratio);
}

// weight = mask · map, the map interpolated between its points; below a twentieth it is nothing.
__kernel void apply_map(__global const float* mask, __global const float* map, const int width, const int height,
                        const int map_width, const int map_height, __global float* weight) {
  const int i = get_global_id(0);
  if (i >= width * height) return;
  const float x = fmin((float)(i % width) / (float)MAP_STEP, (float)(map_width - 1) - 0.001f);
  const float y = fmin((float)(i / width) / (float)MAP_STEP, (float)(map_height - 1) - 0.001f);
  const int ix = (int)x, iy = (int)y;
  const float fx = x - (float)ix, fy = y - (float)iy;
  __global const float* m = map + iy * map_width + ix;
  const float top = mix(m[0], m[1], fx), bottom = mix(m[map_width], m[map_width + 1], fx);
  const float w = mix(top, bottom, fy);
  weight[i] = mask[i] * (w < 0.05f ? 0.0f : w);
}

// Plan: per tile the dominant axis and the range of slices that can hold tissue, from the occupancy grid.
typedef struct {
  float m_a[4], m_b[4], a_c[4], b_c[4];  // the tile's corner rays
} Corners;

// Whether a brick of slices, seen through the tile, touches tissue. The in-slice coordinates are ratios of linear
// functions of the pixel and linear in the slice, so their extremes over tile and brick are at the corners.
INLINE int touches_tissue(__global const uchar* occupancy, const Grid grid, const Corners* corners, int k, int brick) {
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const int3 size = (int3)(grid.size_x, grid.size_y, grid.size_z);
  const int3 bricks = (int3)(grid.bricks_x, grid.bricks_y, grid.bricks_z);
  const float centre_k = component_f((float3)(grid.centre_x, grid.centre_y, grid.centre_z), k);
  const float j_low = (float)(brick * BRICK) - centre_k;
  const float j_high = (float)(min(brick * BRICK + BRICK, component_i(size, k)) - 1) - centre_k;
  float a_low = 1e30f, a_high = -1e30f, b_low = 1e30f, b_high = -1e30f;
  for (int corner = 0; corner < 4; ++corner) {
    const float a1 = fma(j_low, corners->m_a[corner], corners->a_c[corner]);
    const float a2 = fma(j_high, corners->m_a[corner], corners->a_c[corner]);
    const float b1 = fma(j_low, corners->m_b[corner], corners->b_c[corner]);
    const float b2 = fma(j_high, corners->m_b[corner], corners->b_c[corner]);
    a_low = fmin(a_low, fmin(a1, a2));
    a_high = fmax(a_high, fmax(a1, a2));
    b_low = fmin(b_low, fmin(b1, b2));
    b_high = fmax(b_high, fmax(b1, b2));
  }
  // A hundredth of a voxel covers the rounding of the march's own coordinates.
  const int a_first = (int)(fmax(a_low - 0.01f, 0.0f)) / BRICK;
  const int a_last = a_high < 0.0f ? -1 : (int)fmin(a_high + 0.01f, (float)(component_i(size, a) - 1)) / BRICK;
  const int b_first = (int)(fmax(b_low - 0.01f, 0.0f)) / BRICK;
  const int b_last = b_high < 0.0f ? -1 : (int)fmin(b_high + 0.01f, (float)(component_i(size, b) - 1)) / BRICK;
  const int3 stride = (int3)(1, bricks.x, bricks.x * bricks.y);
  const int stride_a = component_i(stride, a), stride_b = component_i(stride, b);
  const int start = brick * component_i(stride, k);
  for (int ib = b_first; ib <= b_last; ++ib) {
    for (int ia = a_first; ia <= a_last; ++ia) {
      if (occupancy[start + ia * stride_a + ib * stride_b]) return 1;
    }
  }
  return 0;
}

// One group per (tile, pose). With LANES 1 its work-items test the bricks side by side, else one looks from both ends.
__kernel void plan(__global const uchar* occupancy, const Grid grid, __global const float* poses, const int tiles_x,
                   const int tiles, __global const int* tile_used, __global int4* plans) {
  __local int first, last;
  const int lid = get_local_id(0);
  const int tile = get_group_id(0) % tiles;
  __global const float* pose = poses + (get_group_id(0) / tiles) * POSE_STRIDE;
  const int2 origin = tile_origin(tile, tiles_x);
  const float u0 = (float)origin.x - pose[P_MID_U];
  const float v0 = (float)origin.y - pose[P_MID_V];
  const int used = tile_used[tile];

  const float um = u0 + 0.5f * (TILE - 1), vm = v0 + 0.5f * (TILE - 1);
  const float3 middle = (float3)(linear(pose + P_DIRECTION, um, vm), linear(pose + P_DIRECTION + 3, um, vm),
                                 linear(pose + P_DIRECTION + 6, um, vm));
  const float3 size_of = fabs(middle);
  const int k = (size_of.x >= size_of.y && size_of.x >= size_of.z) ? 0 : (size_of.y >= size_of.z ? 1 : 2);
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const float3 centre = (float3)(grid.centre_x, grid.centre_y, grid.centre_z);
  Corners corners;
  for (int corner = 0; corner < 4; ++corner) {
    const float u = u0 + ((corner & 1) ? (float)(TILE - 1) : 0.0f);
    const float v = v0 + ((corner & 2) ? (float)(TILE - 1) : 0.0f);
    const float inv_dk = 1.0f / away_from_zero(linear(pose + P_DIRECTION + 3 * k, u, v));
    corners.m_a[corner] = linear(pose + P_DIRECTION + 3 * a, u, v) * inv_dk;
    corners.m_b[corner] = linear(pose + P_DIRECTION + 3 * b, u, v) * inv_dk;
    corners.a_c[corner] = -linear(pose + P_CROSS + 3 * b, u, v) * inv_dk + component_f(centre, a);
    corners.b_c[corner] = linear(pose + P_CROSS + 3 * a, u, v) * inv_dk + component_f(centre, b);
  }
  const int bricks_k = component_i((int3)(grid.bricks_x, grid.bricks_y, grid.bricks_z), k);

  if (lid == 0) {
    first = bricks_k;
    last = -1;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
#if LANES > 1
  if (used) {
    int low = 0, high = bricks_k - 1;
    while (low < bricks_k && !touches_tissue(occupancy, grid, &corners, k, low)) ++low;
    while (high > low && !touches_tissue(occupancy, grid, &corners, k, high)) --high;
    first = low;
    last = low < bricks_k ? high : -1;
  }
#else
  for (int brick = lid; brick < bricks_k && used; brick += get_local_size(0)) {
    if (touches_tissue(occupancy, grid, &corners, k, brick)) {
      atomic_min(&first, brick);
      atomic_max(&last, brick);
    }
  }
#endif
  barrier(CLK_LOCAL_MEM_FENCE);
  if (lid == 0) {
    int j0 = 0, j1 = -1;
    if (first <= last) {
      j0 = first * BRICK;
      j1 = min(last * BRICK + BRICK, component_i((int3)(grid.size_x, grid.size_y, grid.size_z), k)) - 1;
      // Only what lies in front of the source counts; the source may be inside the volume.
      const float source_slice = clamp(pose[P_SOURCE + k] + component_f(centre, k), -1e6f, 1e6f);
      if (component_f(middle, k) >= 0.0f) j0 = max(j0, (int)ceil(source_slice));
      else j1 = min(j1, (int)floor(source_slice));
    }
    plans[get_group_id(0)] = (int4)(k, j0, j1, used);
  }
}

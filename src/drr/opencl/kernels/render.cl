// Value only: the DRR.
__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void render(__global const uint* volume, const Grid grid, __global const float* poses, __global const int4* plans,
            const int tiles_x, const int tiles, const int width, const int height, __global float* image) {
  PREPARE_RAYS
  float value[LANES];
  for (int r = 0; r < LANES; ++r) value[r] = 0.0f;
#define LOAD_SUMS
#define STORE_SUMS
  MARCH_ALONG(k, ACCUMULATE_VALUE)
#undef LOAD_SUMS
#undef STORE_SUMS
#if SPLIT > 1
  __local float parts[GROUP];
  parts[get_local_id(0)] = value[0];
  barrier(CLK_LOCAL_MEM_FENCE);
  if (part > 0) return;
  for (int other = 1; other < SPLIT; ++other) value[0] += parts[other * RAYS + first_ray];
#endif
  for (int r = 0; r < LANES; ++r) {
    const int ray = first_ray + r;
    const int column = RAY_COLUMN(ray), row = RAY_ROW(ray);
    if (column < width && row < height) {
      const RayGeometry g = ray_geometry(pose, k, RAY_U(ray), RAY_V(ray));
      image[(pose_index * height + row) * width + column] = value[r] * g.length_mm * pose[P_SCALE];
    }
  }
}

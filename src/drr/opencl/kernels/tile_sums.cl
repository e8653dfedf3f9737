// The step: per tile the 45 weighted sums of products of (1, D, I, ∂D/∂ξ₀ … ∂D/∂ξ₅), D and I relative to the values
// of the tile's first pixel, which are stored behind the sums.
__constant uchar kFirst[SUMS] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2,
                                 2, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 7, 7, 8};
__constant uchar kSecond[SUMS] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 1, 2, 3, 4, 5, 6, 7, 8, 2, 3, 4, 5, 6, 7,
                                  8, 3, 4, 5, 6, 7, 8, 4, 5, 6, 7, 8, 5, 6, 7, 8, 6, 7, 8, 7, 8, 8};

__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void tile_sums(__global const uint* volume, const Grid grid, __global const float* poses, __global const int4* plans,
               const int tiles_x, const int tiles, const int width, const int height,
               __global const float* xray, __global const float* weight, __global float* sums_out) {
  __local float vectors[VECTORS * RAYS];
  __local float weighted[VECTORS * RAYS];
  __local float reference[2];
  PREPARE_RAYS
  MARCH_WITH_DERIVATIVES
  JOIN_PARTS
  if (get_local_id(0) == 0) {
    const RayGeometry g = ray_geometry(pose, k, RAY_U(0), RAY_V(0));
    reference[0] = value[0] * g.length_mm * pose[P_SCALE];
    reference[1] = xray[min(origin.y, height - 1) * width + min(origin.x, width - 1)];
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (part == 0) {
    const float value_ref = reference[0], xray_ref = reference[1];
    for (int r = 0; r < LANES; ++r) {
      const int ray = first_ray + r;
      const int column = RAY_COLUMN(ray), row = RAY_ROW(ray);
      const int pixel = min(row, height - 1) * width + min(column, width - 1);
      const float w = weight[pixel] * (float)((column < width) & (row < height) & plan_of_tile.w);
      const float intensity = xray[pixel] - xray_ref;
      DERIVATIVES_OF_RAY
      vectors[ray] = 1.0f;
      vectors[RAYS + ray] = line_integral - value_ref;
      vectors[2 * RAYS + ray] = intensity;
      weighted[ray] = w;
      weighted[RAYS + ray] = w * (line_integral - value_ref);
      weighted[2 * RAYS + ray] = w * intensity;
      _Pragma("unroll") for (int i = 0; i < 6; ++i) {
        vectors[(3 + i) * RAYS + ray] = partial[i];
        weighted[(3 + i) * RAYS + ray] = w * partial[i];
      }
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int sum = get_local_id(0); sum < SUMS; sum += GROUP) {
    __local const float* first = weighted + kFirst[sum] * RAYS;
    __local const float* second = vectors + kSecond[sum] * RAYS;
    // Sixteen independent sums: vector lanes on a CPU, hidden latency on a GPU.
    float16 chain = vload16(0, first) * vload16(0, second);
    chain = fma(vload16(1, first), vload16(1, second), chain);
    chain = fma(vload16(2, first), vload16(2, second), chain);
    chain = fma(vload16(3, first), vload16(3, second), chain);
    const float8 chain8 = chain.lo + chain.hi;
    const float4 chain4 = chain8.lo + chain8.hi;
    const float2 chain2 = chain4.lo + chain4.hi;
    sums_out[get_group_id(0) * SUM_STRIDE + sum] = chain2.x + chain2.y;
  }
  if (get_local_id(0) == 0) {
    sums_out[get_group_id(0) * SUM_STRIDE + SUMS] = reference[0];
    sums_out[get_group_id(0) * SUM_STRIDE + SUMS + 1] = reference[1];
  }
}

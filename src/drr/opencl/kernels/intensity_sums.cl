// A tile that sees no tissue has no DRR: there is nothing to add up but the X-ray. Such tiles are most of a crop's around
// a small bone. Only where a group is one work-item, as SKIP_UNUSED_TILE.
#if LANES > 1
#define SUMS_OF_AIR                                                                                              \
  if (plan_of_tile.z < plan_of_tile.y && !SEEN_WITH_MORE) {                                                      \
    const float air_ref = xray[min(origin.y, height - 1) * width + min(origin.x, width - 1)];                    \
    PIXELS_OF_RAYS                                                                                               \
    for (int ray = 0; ray < RAYS; ++ray) {                                                                       \
      vectors[ray] = 1.0f;                                                                                       \
      vectors[2 * RAYS + ray] = xray_of[ray] - air_ref;                                                          \
      weighted[ray] = weight_of[ray];                                                                            \
      weighted[2 * RAYS + ray] = weight_of[ray] * (xray_of[ray] - air_ref);                                      \
    }                                                                                                            \
    __global float* sums = sums_out + get_group_id(0) * SUM_STRIDE;                                              \
    for (int sum = 0; sum <= SUMS; ++sum) sums[sum] = 0.0f;                                                      \
    sums[0] = product_of(weighted, vectors);                                                                     \
    sums[PAIR(0, 2)] = product_of(weighted, vectors + 2 * RAYS);                                                 \
    sums[PAIR(2, 2)] = product_of(weighted + 2 * RAYS, vectors + 2 * RAYS);                                      \
    sums[SUMS + 1] = air_ref;                                                                                    \
    return;                                                                                                      \
  }
#else
#define SUMS_OF_AIR
#endif

// Sums of the line integrals themselves. D and I are relative to the values of the tile's first pixel, so that float
// suffices.
__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void intensity_sums(SUMS_ARGUMENTS) {
  __local float vectors[VECTORS * RAYS];
  __local float weighted[VECTORS * RAYS];
  __local float reference[2];
  PREPARE_RAYS
  SKIP_UNUSED_TILE(SUMS, SUM_STRIDE)
  SUMS_OF_AIR
  MARCH_WITH_DERIVATIVES
  JOIN_PARTS
  REFERENCE_OF_TILE
  if (part == 0) {
    const float value_ref = reference[0], xray_ref = reference[1];
    PIXELS_OF_RAYS
    WIDE_VECTORS
    for (int r = 0; r < LANES; ++r) {
      const int ray = first_ray + r;
      const float w = weight_of[r];
      const float intensity = xray_of[r] - xray_ref;
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
    // A loop of its own, so that it costs nothing where there is one body.
    for (int r = 0; r < LANES && SEEN_WITH_MORE; ++r) {
      const int ray = first_ray + r;
      const int pixel = min(RAY_ROW(ray), height - 1) * width + min(RAY_COLUMN(ray), width - 1);
      const Seen seen = seen_in_pixel(vectors[RAYS + ray] + value_ref, surroundings, surrounded, pixel, saturation);
      vectors[RAYS + ray] = seen.value - value_ref;
      weighted[RAYS + ray] = weighted[ray] * (seen.value - value_ref);
      for (int i = 3; i < VECTORS; ++i) {
        vectors[i * RAYS + ray] *= seen.passed;
        weighted[i * RAYS + ray] *= seen.passed;
      }
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int sum = get_local_id(0); sum < SUMS; sum += GROUP) {
    sums_out[get_group_id(0) * SUM_STRIDE + sum] =
        product_of(weighted + kFirst[sum] * RAYS, vectors + kSecond[sum] * RAYS);
  }
  if (get_local_id(0) == 0) {
    sums_out[get_group_id(0) * SUM_STRIDE + SUMS] = reference[0];
    sums_out[get_group_id(0) * SUM_STRIDE + SUMS + 1] = reference[1];
  }
}

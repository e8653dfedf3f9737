// Sums for a body among what surrounds it: as intensity_sums, with the body's own part of the DRR as a tenth vector
// behind the derivatives, so that whoever joins the tiles can tell the body from its surroundings.
#define BODY_VECTORS (VECTORS + 1)
#define BODY_SUMS (BODY_VECTORS * (BODY_VECTORS + 1) / 2)

__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void body_sums(SUMS_ARGUMENTS) {
  __local float vectors[BODY_VECTORS * RAYS];
  __local float weighted[BODY_VECTORS * RAYS];
  __local float reference[2];
  PREPARE_RAYS
  SKIP_UNUSED_TILE(BODY_SUMS, BODY_SUMS + 2)
  MARCH_WITH_DERIVATIVES
  JOIN_PARTS
  REFERENCE_OF_TILE
  if (part == 0) {
    const float value_ref = reference[0], xray_ref = reference[1];
    PIXELS_OF_RAYS
    WIDE_VECTORS
    for (int r = 0; r < LANES; ++r) {
      const int ray = first_ray + r;
      DERIVATIVES_OF_RAY
      vectors[ray] = 1.0f;
      weighted[ray] = weight_of[r];
      vectors[2 * RAYS + ray] = xray_of[r] - xray_ref;
      _Pragma("unroll") for (int i = 0; i < 6; ++i) vectors[(3 + i) * RAYS + ray] = partial[i];
      vectors[VECTORS * RAYS + ray] = line_integral;
    }
    for (int r = 0; r < LANES; ++r) {
      const int ray = first_ray + r;
      const int pixel = min(RAY_ROW(ray), height - 1) * width + min(RAY_COLUMN(ray), width - 1);
      const Seen seen = seen_in_pixel(vectors[VECTORS * RAYS + ray], surroundings, surrounded, pixel, saturation);
      vectors[RAYS + ray] = seen.value - value_ref;
      for (int i = 3; i < BODY_VECTORS; ++i) vectors[i * RAYS + ray] *= seen.passed;
      for (int i = 1; i < BODY_VECTORS; ++i) weighted[i * RAYS + ray] = weighted[ray] * vectors[i * RAYS + ray];
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  __global float* out = sums_out + (size_t)get_group_id(0) * (BODY_SUMS + 2);
  int pair = 0;
  for (int first = 0; first < BODY_VECTORS; ++first) {
    for (int second = first + (int)get_local_id(0); second < BODY_VECTORS; second += GROUP) {
      out[pair + second - first] = product_of(weighted + first * RAYS, vectors + second * RAYS);
    }
    pair += BODY_VECTORS - first;
  }
  if (get_local_id(0) == 0) {
    out[pair] = reference[0];
    out[pair + 1] = reference[1];
  }
}

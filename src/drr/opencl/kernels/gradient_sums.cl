// Sums of the image gradients (G. P. Penney et al., "A comparison of similarity measures for use in 2-D-3-D medical image
// registration", 1998): D and I are the two components of the gradient, one behind the other, so that a window's
// correlation is that of two vector fields. Gradients are differences over 2 × 2 pixels inside the tile, both components
// at the same place; a difference is linear, so the derivatives' differences are the exact derivatives. No mean is
// subtracted: the sums of products with 1 are zero but for the first, the sum of the weights. A gradient weighs what the
// least of its four pixels does.
__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void gradient_sums(SUMS_ARGUMENTS) {
  __local float images[VECTORS * RAYS];  // weight, D, I, ∂D
  __local float vectors[2 * VECTORS * RAYS];
  __local float weighted[2 * VECTORS * RAYS];
  PREPARE_RAYS
  SKIP_UNUSED_TILE(SUMS, SUM_STRIDE)
  MARCH_WITH_DERIVATIVES
  JOIN_PARTS
  if (part == 0) {
    PIXELS_OF_RAYS
    WIDE_VECTORS
    for (int r = 0; r < LANES; ++r) {
      const int ray = first_ray + r;
      DERIVATIVES_OF_RAY
      images[ray] = weight_of[r];
      images[RAYS + ray] = line_integral;
      images[2 * RAYS + ray] = xray_of[r];
      _Pragma("unroll") for (int i = 0; i < 6; ++i) images[(3 + i) * RAYS + ray] = partial[i];
    }
    for (int r = 0; r < LANES && SEEN_WITH_MORE; ++r) {
      const int ray = first_ray + r;
      const int pixel = min(RAY_ROW(ray), height - 1) * width + min(RAY_COLUMN(ray), width - 1);
      const Seen seen = seen_in_pixel(images[RAYS + ray], surroundings, surrounded, pixel, saturation);
      images[RAYS + ray] = seen.value;
      for (int i = 3; i < VECTORS; ++i) images[i * RAYS + ray] *= seen.passed;
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int ray = get_local_id(0); ray < RAYS; ray += GROUP) {
    // The last column and row have no neighbours in the tile; they weigh nothing.
    const int inside = (ray % TILE < TILE - 1) & (ray / TILE < TILE - 1);
    const int right = inside ? ray + 1 : ray, below = inside ? ray + TILE : ray, across = inside ? ray + TILE + 1 : ray;
    const float w = (float)inside * fmin(fmin(images[ray], images[right]), fmin(images[below], images[across]));
    vectors[ray] = 1.0f;
    weighted[ray] = w;
    for (int i = 1; i < VECTORS; ++i) {
      __local const float* image = images + i * RAYS;
      const float falling = image[across] - image[ray], rising = image[right] - image[below];
      vectors[i * RAYS + ray] = 0.5f * (falling + rising);
      vectors[(VECTORS + i) * RAYS + ray] = 0.5f * (falling - rising);
      weighted[i * RAYS + ray] = w * 0.5f * (falling + rising);
      weighted[(VECTORS + i) * RAYS + ray] = w * 0.5f * (falling - rising);
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int sum = get_local_id(0); sum < SUMS; sum += GROUP) {
    const int first = kFirst[sum], second = kSecond[sum];
    float total = 0.0f;
    if (first > 0) {
      total = product_of(weighted + first * RAYS, vectors + second * RAYS) +
              product_of(weighted + (VECTORS + first) * RAYS, vectors + (VECTORS + second) * RAYS);
    } else if (second == 0) {
      total = product_of(weighted, vectors);
    }
    sums_out[get_group_id(0) * SUM_STRIDE + sum] = total;
  }
  if (get_local_id(0) == 0) {
    sums_out[get_group_id(0) * SUM_STRIDE + SUMS] = 0.0f;
    sums_out[get_group_id(0) * SUM_STRIDE + SUMS + 1] = 0.0f;
  }
}

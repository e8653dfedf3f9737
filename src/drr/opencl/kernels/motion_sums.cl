// Sums of line integrals and their derivatives by any motions of the rays (ray_motion.h), not only the pose's: what a
// focal length, a distortion or the CT's size would do to the image. Slower than intensity_sums, for the check of what
// was told, which runs now and then.

// The derivative of a ray's line integral by where its source is and by its direction, camera axes. Numbers by
// themselves: a compiler does not turn loops over rays with vectors of three in them into vector code.
typedef struct {
  float source_x, source_y, source_z, direction_x, direction_y, direction_z;
} RayGradient;

// As chain_rule, for any motion: dm_a = (dd_a − m_a dd_k) / d_k, and G carries camera axes to voxels.
INLINE RayGradient ray_gradient(__global const float* pose, int k, const RayGeometry g, float value, float sa, float sb,
                                float ja, float jb) {
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const float along_a = fma(-pose[P_SOURCE + k], sa, ja) * g.inv_dk;
  const float along_b = fma(-pose[P_SOURCE + k], sb, jb) * g.inv_dk;
  const float source_k = -fma(g.m_a, sa, g.m_b * sb);
  const float direction_k = -fma(g.inv_dk, value, fma(g.m_a, along_a, g.m_b * along_b));
  __global const float* row_k = pose + P_ROTATION + 3 * k;
  __global const float* row_a = pose + P_ROTATION + 3 * a;
  __global const float* row_b = pose + P_ROTATION + 3 * b;
  const RayGradient gradient = {fma(row_k[0], source_k, fma(row_a[0], sa, row_b[0] * sb)),
                                fma(row_k[1], source_k, fma(row_a[1], sa, row_b[1] * sb)),
                                fma(row_k[2], source_k, fma(row_a[2], sa, row_b[2] * sb)),
                                fma(row_k[0], direction_k, fma(row_a[0], along_a, row_b[0] * along_b)),
                                fma(row_k[1], direction_k, fma(row_a[1], along_a, row_b[1] * along_b)),
                                fma(row_k[2], direction_k, fma(row_a[2], along_a, row_b[2] * along_b))};
  return gradient;
}

// By a motion of rays; (x, y, 1) is the ray's direction.
INLINE float derivative_by(__global const float* motion, const RayGradient gradient, float x, float y, float value) {
  const float r2 = fma(x, x, y * y);
  __global const float* matrix = motion + M_DIRECTION;
  const float radial = r2 * motion[M_RADIAL], swirl = r2 * motion[M_SWIRL];
  const float moved_x = fma(matrix[0], x, fma(matrix[1], y, matrix[2])) + fma(radial, x, -swirl * y);
  const float moved_y = fma(matrix[3], x, fma(matrix[4], y, matrix[5])) + fma(radial, y, swirl * x);
  const float moved_z = fma(matrix[6], x, fma(matrix[7], y, matrix[8]));
  // A ray of the camera that leans more is longer between two slices.
  const float along = fma(x, moved_x, fma(y, moved_y, moved_z));
  const float lengthened = motion[M_OF_CAMERA] * value * along / (r2 + 1.0f);
  const float by_source = fma(gradient.source_x, motion[M_SOURCE],
                              fma(gradient.source_y, motion[M_SOURCE + 1], gradient.source_z * motion[M_SOURCE + 2]));
  const float by_direction =
      fma(gradient.direction_x, moved_x, fma(gradient.direction_y, moved_y, gradient.direction_z * moved_z));
  return by_source + by_direction + lengthened;
}

__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void motion_sums(SUMS_ARGUMENTS, __global const float* motions, const int motion_count) {
  __local float vectors[(3 + MOST_MOTIONS) * RAYS];
  __local float weights[RAYS];
  __local float weighted[RAYS];
  __local float reference[2];
  PREPARE_RAYS
  const int count = 3 + motion_count;
  SKIP_UNUSED_TILE(count * (count + 1) / 2, count * (count + 1) / 2 + 2)
  MARCH_WITH_DERIVATIVES
  JOIN_PARTS
  REFERENCE_OF_TILE
  if (part == 0) {
    PIXELS_OF_RAYS
    float line_of[LANES], source_x[LANES], source_y[LANES], source_z[LANES];
    float direction_x[LANES], direction_y[LANES], direction_z[LANES];
    WIDE_VECTORS
    for (int r = 0; r < LANES; ++r) {
      const int ray = first_ray + r;
      const RayGeometry g = ray_geometry(pose, k, RAY_U(ray), RAY_V(ray));
      const float mm = g.length_mm * pose[P_SCALE];
      const RayGradient gradient =
          ray_gradient(pose, k, g, value[r] * mm, mm * (k == 0 ? sum_dq[r] : sum_dp[r]),
                       mm * (k == 0 ? sum_dp[r] : sum_dq[r]), mm * (k == 0 ? sum_jdq[r] : sum_jdp[r]),
                       mm * (k == 0 ? sum_jdp[r] : sum_jdq[r]));
      line_of[r] = value[r] * mm;
      source_x[r] = gradient.source_x;
      source_y[r] = gradient.source_y;
      source_z[r] = gradient.source_z;
      direction_x[r] = gradient.direction_x;
      direction_y[r] = gradient.direction_y;
      direction_z[r] = gradient.direction_z;
      weights[ray] = weight_of[r];
      vectors[ray] = 1.0f;
      vectors[RAYS + ray] = line_of[r] - reference[0];
      vectors[2 * RAYS + ray] = xray_of[r] - reference[1];
    }
    for (int i = 0; i < motion_count; ++i) {
      __global const float* motion = motions + i * MOTION_STRIDE;
      WIDE_VECTORS
      for (int r = 0; r < LANES; ++r) {
        const int ray = first_ray + r;
        const float x = (RAY_U(ray) - pose[P_CX]) * pose[P_INV_FX], y = (RAY_V(ray) - pose[P_CY]) * pose[P_INV_FY];
        const RayGradient gradient = {source_x[r], source_y[r], source_z[r], direction_x[r], direction_y[r], direction_z[r]};
        vectors[(3 + i) * RAYS + ray] = derivative_by(motion, gradient, x, y, line_of[r]);
      }
    }
    for (int r = 0; r < LANES && SEEN_WITH_MORE; ++r) {
      const int ray = first_ray + r;
      const int pixel = min(RAY_ROW(ray), height - 1) * width + min(RAY_COLUMN(ray), width - 1);
      const Seen seen = seen_in_pixel(line_of[r], surroundings, surrounded, pixel, saturation);
      vectors[RAYS + ray] = seen.value - reference[0];
      for (int i = 0; i < motion_count; ++i) vectors[(3 + i) * RAYS + ray] *= seen.passed;
    }
  }
  __global float* out = sums_out + (size_t)get_group_id(0) * (count * (count + 1) / 2 + 2);
  int pair = 0;
  for (int first = 0; first < count; ++first) {
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int ray = get_local_id(0); ray < RAYS; ray += GROUP) weighted[ray] = weights[ray] * vectors[first * RAYS + ray];
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int second = first + (int)get_local_id(0); second < count; second += GROUP) {
      out[pair + second - first] = product_of(weighted, vectors + second * RAYS);
    }
    pair += count - first;
  }
  if (get_local_id(0) == 0) {
    out[pair] = reference[0];
    out[pair + 1] = reference[1];
  }
}

// Windows of span_x × span_y tiles, one work-item each: the correlation of a window's DRR and X-ray from its tiles' sums,
// its exact gradient, its Gauss-Newton matrix. docs/design.md has the formulae, opencl/layout.h what the terms are.
#define PAIR(i, j) ((i) * VECTORS - (i) * ((i) - 1) / 2 + (j) - (i))

__kernel __attribute__((reqd_work_group_size(RAYS, 1, 1)))
void windows(__global const float* tile_sums_in, const int tiles_x, const int tiles_y, const int span_x,
             const int span_y, const int windows_x, const int windows_y, const int window_groups, const float epsilon_value2,
             const float epsilon_xray2, const float robust_scale2, const float contrast2,
             const float min_weight, __global float* correlations, __global float* terms_out) {
  __local float terms[TERMS * RAYS];
  const int lid = get_local_id(0);
  const int pose_index = get_group_id(0) / window_groups;
  const int group = get_group_id(0) % window_groups;
  const int window = group * RAYS + lid;
  const int inside = window < windows_x * windows_y;
  const int wx = inside ? window % windows_x : 0, wy = inside ? window / windows_x : 0;
  __global const float* base = tile_sums_in + pose_index * tiles_x * tiles_y * SUM_STRIDE;

  float s[SUMS];
  for (int i = 0; i < SUMS; ++i) s[i] = 0.0f;
  const float value_ref = base[(wy * tiles_x + wx) * SUM_STRIDE + SUMS];
  const float xray_ref = base[(wy * tiles_x + wx) * SUM_STRIDE + SUMS + 1];
  for (int ty = wy; ty < wy + span_y; ++ty) {
    for (int tx = wx; tx < wx + span_x; ++tx) {
      __global const float* t = base + (ty * tiles_x + tx) * SUM_STRIDE;
      // Each tile has its own reference; carry it to the window's.
      const float dv = t[SUMS] - value_ref, dx = t[SUMS + 1] - xray_ref;
      for (int i = 0; i < SUMS; ++i) s[i] += t[i];
      const float w = t[0];
      s[PAIR(0, 1)] += dv * w;
      s[PAIR(0, 2)] += dx * w;
      s[PAIR(1, 1)] += 2.0f * dv * t[PAIR(0, 1)] + dv * dv * w;
      s[PAIR(1, 2)] += dv * t[PAIR(0, 2)] + dx * t[PAIR(0, 1)] + dv * dx * w;
      s[PAIR(2, 2)] += 2.0f * dx * t[PAIR(0, 2)] + dx * dx * w;
      for (int i = 0; i < 6; ++i) {
        s[PAIR(1, 3 + i)] += dv * t[PAIR(0, 3 + i)];
        s[PAIR(2, 3 + i)] += dx * t[PAIR(0, 3 + i)];
      }
    }
  }

  const float n = s[0];
  const int counts = inside && n >= min_weight;
  const float inv_n = counts ? 1.0f / n : 0.0f;
  const float mean_v = s[PAIR(0, 1)] * inv_n, mean_x = s[PAIR(0, 2)] * inv_n;
  const float var_v = fmax(s[PAIR(1, 1)] * inv_n - mean_v * mean_v, 0.0f);
  const float var_x = fmax(s[PAIR(2, 2)] * inv_n - mean_x * mean_x, 0.0f);
  const float cov = s[PAIR(1, 2)] * inv_n - mean_v * mean_x;
  const float inv_v2 = 1.0f / (var_v + epsilon_value2), inv_x2 = 1.0f / (var_x + epsilon_xray2);
  const float inv_v = sqrt(inv_v2), inv_x = sqrt(inv_x2);
  const float correlation = counts ? cov * inv_v * inv_x : 0.0f;
  // Geman-McClure on e = 1 - correlation: cost e s² / (e + s²), weight its derivative.
  const float e = 1.0f - correlation;
  const float inv_scale = 1.0f / (e + robust_scale2);
  const float shrink = robust_scale2 * inv_scale;
  // Windows of little contrast hold noise and what the regularisation makes of it; they count less.
  const float importance = counts ? n * var_x / (var_x + contrast2) : 0.0f;
  const float slope = importance * shrink * shrink;

  float grad_v[6], mean_g[6];
  for (int i = 0; i < 6; ++i) {
    mean_g[i] = s[PAIR(0, 3 + i)] * inv_n;
    grad_v[i] = s[PAIR(1, 3 + i)] * inv_n - mean_v * mean_g[i];
    const float grad_x = s[PAIR(2, 3 + i)] * inv_n - mean_x * mean_g[i];
    // Gradient of e.
    terms[(T_GRADIENT + i) * RAYS + lid] = -slope * inv_x * inv_v * (grad_x - cov * grad_v[i] * inv_v2);
  }
  // Gauss-Newton of two unit vectors' distance, times the correlation: that is the curvature of 1 - correlation where
  // the window does not match well, and without it the steps there are too short.
  const float curvature = slope * inv_v2 * clamp(correlation, 0.1f, 1.0f);
  int term = T_MATRIX;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      const float cov_g = s[PAIR(3 + i, 3 + j)] * inv_n - mean_g[i] * mean_g[j];
      const float normalisation = grad_v[i] * grad_v[j] * inv_v2 * (2.0f - var_v * inv_v2);
      terms[term * RAYS + lid] = curvature * (cov_g - normalisation);
      ++term;
    }
  }
  // Only windows with DRR content say anything about similarity.
  const float content = var_v * inv_v2;
  terms[T_COST * RAYS + lid] = importance * e * shrink;
  terms[T_WEIGHT * RAYS + lid] = importance;
  terms[T_SIMILARITY * RAYS + lid] = counts ? n * content * correlation : 0.0f;
  terms[T_INLIERS * RAYS + lid] = counts ? n * content * (correlation > INLIER_CORRELATION ? 1.0f : 0.0f) : 0.0f;
  terms[T_CONTENT * RAYS + lid] = counts ? n * content : 0.0f;
  if (inside) correlations[pose_index * windows_x * windows_y + window] = counts && content > 0.5f ? correlation : LEFT_OUT;
  // The scatter of the windows' gradients: what noise and model errors do to their sum.
  term = T_SCATTER;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      terms[term * RAYS + lid] = terms[(T_GRADIENT + i) * RAYS + lid] * terms[(T_GRADIENT + j) * RAYS + lid];
      ++term;
    }
  }
  for (int i = TERMS_USED; i < TERMS; ++i) terms[i * RAYS + lid] = 0.0f;
  barrier(CLK_LOCAL_MEM_FENCE);
  if (lid < TERMS) {
    float total = 0.0f;
    for (int i = 0; i < RAYS; ++i) total += terms[lid * RAYS + i];
    terms_out[get_group_id(0) * TERMS + lid] = total;
  }
}

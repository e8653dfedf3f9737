// The five sums of a march with derivatives: ΣB, Σ∂pB, Σ∂qB, Σ j ∂pB, Σ j ∂qB, with j from the box centre.
#define LOAD_SUMS float s_dp = sum_dp[r], s_dq = sum_dq[r], s_jdp = sum_jdp[r], s_jdq = sum_jdq[r];
#define STORE_SUMS        \
  sum_dp[r] = s_dp;       \
  sum_dq[r] = s_dq;       \
  sum_jdp[r] = s_jdp;     \
  sum_jdq[r] = s_jdq;
#define MARCH_WITH_DERIVATIVES                                                        \
  float value[LANES], sum_dp[LANES], sum_dq[LANES], sum_jdp[LANES], sum_jdq[LANES];   \
  for (int r = 0; r < LANES; ++r) {                                                   \
    value[r] = sum_dp[r] = sum_dq[r] = sum_jdp[r] = sum_jdq[r] = 0.0f;                \
  }                                                                                   \
  MARCH_ALONG(k, ACCUMULATE)

#if SPLIT > 1
#define JOIN_PARTS                                                     \
  __local float parts[5 * GROUP];                                      \
  parts[get_local_id(0)] = value[0];                                   \
  parts[GROUP + get_local_id(0)] = sum_dp[0];                          \
  parts[2 * GROUP + get_local_id(0)] = sum_dq[0];                      \
  parts[3 * GROUP + get_local_id(0)] = sum_jdp[0];                     \
  parts[4 * GROUP + get_local_id(0)] = sum_jdq[0];                     \
  barrier(CLK_LOCAL_MEM_FENCE);                                        \
  for (int other = 1; other < SPLIT && part == 0; ++other) {           \
    value[0] += parts[other * RAYS + first_ray];                       \
    sum_dp[0] += parts[GROUP + other * RAYS + first_ray];              \
    sum_dq[0] += parts[2 * GROUP + other * RAYS + first_ray];          \
    sum_jdp[0] += parts[3 * GROUP + other * RAYS + first_ray];         \
    sum_jdq[0] += parts[4 * GROUP + other * RAYS + first_ray];         \
  }
#else
#define JOIN_PARTS
#endif

// The six partial derivatives of the line integral by the twist [v; ω]: the sums' weights by the chain rule.
//   d f = -(dd_k / d_k) f + w Σ [ ∂aB (do_a - do_k m_a + (j - o_k) dm_a) + ∂bB (…) ],  dm_a = (dd_a - m_a dd_k) / d_k
INLINE void chain_rule(__global const float* pose, int k, const RayGeometry g, float value, float sa, float sb,
                       float ja, float jb, float* partial) {
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const float source_k = pose[P_SOURCE + k];
  _Pragma("unroll") for (int i = 0; i < 3; ++i) {  // Translation moves the source alone.
    __global const float* ds = pose + P_DSOURCE + 3 * i;
    partial[i] = fma(fma(-ds[k], g.m_a, ds[a]), sa, fma(-ds[k], g.m_b, ds[b]) * sb);
  }
  _Pragma("unroll") for (int i = 0; i < 3; ++i) {  // Rotation: d(direction) = -G (e_i × d_camera).
    __global const float* ds = pose + P_DSOURCE + 9 + 3 * i;
    const float3 turned = i == 0 ? (float3)(0.0f, -g.d_camera.z, g.d_camera.y)
                                 : (i == 1 ? (float3)(g.d_camera.z, 0.0f, -g.d_camera.x)
                                           : (float3)(-g.d_camera.y, g.d_camera.x, 0.0f));
    __global const float* rotation = pose + P_ROTATION;
    const float dd_k = -(rotation[3 * k] * turned.x + rotation[3 * k + 1] * turned.y + rotation[3 * k + 2] * turned.z);
    const float dd_a = -(rotation[3 * a] * turned.x + rotation[3 * a + 1] * turned.y + rotation[3 * a + 2] * turned.z);
    const float dd_b = -(rotation[3 * b] * turned.x + rotation[3 * b + 1] * turned.y + rotation[3 * b + 2] * turned.z);
    const float dm_a = (dd_a - g.m_a * dd_k) * g.inv_dk;
    const float dm_b = (dd_b - g.m_b * dd_k) * g.inv_dk;
    partial[3 + i] = -dd_k * g.inv_dk * value + fma(-source_k, dm_a, fma(-ds[k], g.m_a, ds[a])) * sa + dm_a * ja +
                     fma(-source_k, dm_b, fma(-ds[k], g.m_b, ds[b])) * sb + dm_b * jb;
  }
}

// Declares `line_integral` and `partial` of lane r.
#define DERIVATIVES_OF_RAY                                                                              \
  const RayGeometry g = ray_geometry(pose, k, RAY_U(first_ray + r), RAY_V(first_ray + r));              \
  const float mm = g.length_mm * pose[P_SCALE];                                                         \
  const float line_integral = value[r] * mm;                                                            \
  float partial[6];                                                                                     \
  chain_rule(pose, k, g, line_integral, mm * (k == 0 ? sum_dq[r] : sum_dp[r]),                          \
             mm * (k == 0 ? sum_dp[r] : sum_dq[r]), mm * (k == 0 ? sum_jdq[r] : sum_jdp[r]),            \
             mm * (k == 0 ? sum_jdp[r] : sum_jdq[r]), partial);

// Value and derivatives as seven images, for tests and for whoever wants to look at them.
__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void render_derivatives(__global const uint* volume, const Grid grid, __global const float* poses,
                        __global const int4* plans, const int tiles_x, const int tiles, const int width,
                        const int height, __global float* images) {
  PREPARE_RAYS
  MARCH_WITH_DERIVATIVES
  JOIN_PARTS
  for (int r = 0; r < LANES; ++r) {
    const int column = RAY_COLUMN(first_ray + r), row = RAY_ROW(first_ray + r);
    if (part == 0 && column < width && row < height) {
      DERIVATIVES_OF_RAY
      const int pixel = row * width + column;
      images[pixel] = line_integral;
      for (int i = 0; i < 6; ++i) images[(i + 1) * width * height + pixel] = partial[i];
    }
  }
}

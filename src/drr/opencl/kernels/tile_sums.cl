// What the kernels that add up a tile share. Per tile they write the weighted sums of products of (1, D, I, ∂D/∂ξ₀ …
// ∂D/∂ξ₅), whatever their D and I are, and behind them the values that D and I are relative to: a similarity's own
// part. windows.cl makes a correlation of them.
#define SUMS_ARGUMENTS                                                                                              \
  __global const uint *volume, const Grid grid, __global const float *poses, __global const int4 *plans,            \
      const int tiles_x, const int tiles, const int width, const int height, __global const float *xray,            \
      __global const float *weight, __global const float *surroundings, const int surrounded,                       \
      const float saturation, __global float *sums_out

// What the detector shows of a ray: the body's line integral and that of what else the ray meets, and less where it
// saturates, value = S (1 − exp(−sum / S)); `passed` is the derivative by the line integral.
typedef struct {
  float value, passed;
} Seen;

INLINE Seen seen_by_detector(float line_integral, float surrounding, float saturation) {
  Seen seen = {line_integral + surrounding, 1.0f};
  if (saturation > 0.0f) {
    seen.passed = exp(-seen.value / saturation);
    seen.value = saturation * (1.0f - seen.passed);
  }
  return seen;
}

// Whether a detector shows anything else than the body's own line integrals.
#define SEEN_WITH_MORE ((surrounded != 0) | (saturation > 0.0f))

INLINE Seen seen_in_pixel(float line_integral, __global const float* surroundings, int surrounded, int pixel,
                          float saturation) {
  return seen_by_detector(line_integral, surrounded ? surroundings[pixel] : 0.0f, saturation);
}

// A tile that is not used costs nothing: all its sums are zero. Only where a group is one work-item: PoCL cannot compile
// a return before a barrier.
#if LANES > 1
#define SKIP_UNUSED_TILE(sum_count, stride)                                                                    \
  if (!plan_of_tile.w) {                                                                                       \
    for (int sum = get_local_id(0); sum <= (sum_count) + 1; sum += GROUP) {                                    \
      sums_out[(size_t)get_group_id(0) * (stride) + sum] = 0.0f;                                               \
    }                                                                                                          \
    return;                                                                                                    \
  }
#else
#define SKIP_UNUSED_TILE(sum_count, stride)
#endif

// The values of the tile's first pixel, which DRR and X-ray are relative to so that float suffices, into `reference`.
#define REFERENCE_OF_TILE                                                                \
  if (get_local_id(0) == 0) {                                                            \
    const RayGeometry g = ray_geometry(pose, k, RAY_U(0), RAY_V(0));                     \
    const int first_pixel = min(origin.y, height - 1) * width + min(origin.x, width - 1); \
    reference[0] = seen_in_pixel(value[0] * g.length_mm * pose[P_SCALE], surroundings,   \
                                 surrounded, first_pixel, saturation).value;             \
    reference[1] = xray[first_pixel];                                                    \
  }                                                                                      \
  barrier(CLK_LOCAL_MEM_FENCE);

// The X-ray's pixels and their weights at the rays, `xray_of` and `weight_of`; rays beside the image weigh nothing. What
// is gathered could lie anywhere, also in what the next loop writes, for all that a compiler knows; so it stands in a
// loop of its own, and the next one, with all the arithmetic, becomes vector code.
#define PIXELS_OF_RAYS                                                                                 \
  float xray_of[LANES], weight_of[LANES];                                                              \
  for (int r = 0; r < LANES; ++r) {                                                                    \
    const int column = RAY_COLUMN(first_ray + r), row = RAY_ROW(first_ray + r);                        \
    const int pixel = min(row, height - 1) * width + min(column, width - 1);                           \
    weight_of[r] = weight[pixel] * (float)((column < width) & (row < height) & plan_of_tile.w);        \
    xray_of[r] = xray[pixel];                                                                          \
  }

__constant uchar kFirst[SUMS] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2,
                                 2, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 7, 7, 8};
__constant uchar kSecond[SUMS] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 1, 2, 3, 4, 5, 6, 7, 8, 2, 3, 4, 5, 6, 7,
                                  8, 3, 4, 5, 6, 7, 8, 4, 5, 6, 7, 8, 5, 6, 7, 8, 6, 7, 8, 7, 8, 8};

// Σ first · second over a tile's rays. Sixteen independent sums: vector lanes on a CPU, hidden latency on a GPU.
INLINE float product_of(__local const float* first, __local const float* second) {
  float16 chain = vload16(0, first) * vload16(0, second);
  chain = fma(vload16(1, first), vload16(1, second), chain);
  chain = fma(vload16(2, first), vload16(2, second), chain);
  chain = fma(vload16(3, first), vload16(3, second), chain);
  const float8 chain8 = chain.lo + chain.hi;
  const float4 chain4 = chain8.lo + chain8.hi;
  const float2 chain2 = chain4.lo + chain4.hi;
  return chain2.x + chain2.y;
}

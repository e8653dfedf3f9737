// The march. In-slice axes are named p (the axis whose neighbours are one 32-bit load) and q. Coordinates are padded
// voxel indices; two layers of air around the box let a clamp replace a branch: a clamped sample lies between two air
// voxels, so value and derivatives are zero.
//
// For dominant axis k the cyclic in-slice axes are a = k + 1, b = k + 2.
//
// In words, a voxel and its neighbour in z: the pair axis z is b for k = 0, a for k = 1; for k = 2 there is none and p =
// a. The words of neighbours in x stand side by side: that is q for k = 1, p for k = 2.
//
// On a CPU the voxels of a CT that is not large stand behind its words once more, 16 bits each: two neighbours in x are
// 32 bits of them, wherever they begin. For k = 2 that is half of what words would load, and nothing to take apart.
#if VOXELS_16
#define IN_VOXELS (grid.has_voxels && k == 2)
#else
#define IN_VOXELS 0
#endif

// What the chain rule needs of a ray besides the sums.
typedef struct {
  float3 d_camera;    // camera axes, z = 1
  float m_a, m_b;     // in-slice steps per slice
  float inv_dk;
  float length_mm;    // between slices, along the ray
} RayGeometry;

INLINE RayGeometry ray_geometry(__global const float* pose, int k, float u, float v) {
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  RayGeometry g;
  g.inv_dk = 1.0f / away_from_zero(linear(pose + P_DIRECTION + 3 * k, u, v));
  g.m_a = linear(pose + P_DIRECTION + 3 * a, u, v) * g.inv_dk;
  g.m_b = linear(pose + P_DIRECTION + 3 * b, u, v) * g.inv_dk;
  g.d_camera = (float3)((u - pose[P_CX]) * pose[P_INV_FX], (v - pose[P_CY]) * pose[P_INV_FY], 1.0f);
  g.length_mm = sqrt(fma(g.d_camera.x, g.d_camera.x, fma(g.d_camera.y, g.d_camera.y, 1.0f))) * fabs(g.inv_dk);
  return g;
}

#define POSITION                                              \
  const float p = clamp(fma(t, m_p[r], p_c[r]), 0.0f, p_max); \
  const float q = clamp(fma(t, m_q[r], q_c[r]), 0.0f, q_max); \
  const int ip = (int)p, iq = (int)q;                         \
  const float fp = p - (float)ip, fq = q - (float)iq;         \
  const int index = ip * stride_p + iq * stride_q + offset;

#define LOAD_PAIRED()                           \
  const uint word0 = volume[index];             \
  const uint word1 = volume[index + stride_q];  \
  const float v00 = LOW(word0), v01 = HIGH(word0), v10 = LOW(word1), v11 = HIGH(word1);

// Words i and i + 1. A CPU gathers by the element, so one element of 64 bits is half the work; a GPU would want it
// aligned.
#if LANES > 1
typedef ulong __attribute__((aligned(4))) TwoWords;
#define LOAD_TWO(first, second, i)                                   \
  const ulong first##_two = *(__global const TwoWords*)(volume + (i)); \
  const uint first = (uint)first##_two, second = (uint)(first##_two >> 32);
#else
#define LOAD_TWO(first, second, i) const uint first = volume[i], second = volume[(i) + 1];
#endif

#define LOAD_PAIRED_AND_NEXT()      \
  LOAD_TWO(word0, word1, index)     \
  const float v00 = LOW(word0), v01 = HIGH(word0), v10 = LOW(word1), v11 = HIGH(word1);

#define LOAD_SINGLE()                          \
  LOAD_TWO(word00, word01, index)              \
  LOAD_TWO(word10, word11, index + stride_q)   \
  const float v00 = LOW(word00), v01 = LOW(word01), v10 = LOW(word10), v11 = LOW(word11);

#if VOXELS_16
// Told in bytes: with an index of voxels LLVM gathers by indices of 64 bits, half as many at a time.
typedef uint __attribute__((aligned(2))) TwoVoxels;
#define TWO_VOXELS(i) *(__global const TwoVoxels*)((__global const char*)voxels + 2 * (i))
#define LOAD_VOXELS()                              \
  const uint word0 = TWO_VOXELS(index);            \
  const uint word1 = TWO_VOXELS(index + stride_q); \
  const float v00 = LOW(word0), v01 = HIGH(word0), v10 = LOW(word1), v11 = HIGH(word1);
#else
#define LOAD_VOXELS LOAD_SINGLE
#endif

#define ACCUMULATE()                            \
  const float d0 = v01 - v00, d1 = v11 - v10;   \
  const float e0 = fma(fp, d0, v00);            \
  const float dq = fma(fp, d1, v10) - e0;       \
  const float dp = fma(fq, d1 - d0, d0);        \
  s_value += fma(fq, dq, e0);                   \
  s_dp += dp;                                   \
  s_dq += dq;                                   \
  s_jdp = fma(t, dp, s_jdp);                    \
  s_jdq = fma(t, dq, s_jdq);

#define ACCUMULATE_VALUE()                      \
  const float e0 = fma(fp, v01 - v00, v00);     \
  const float e1 = fma(fp, v11 - v10, v10);     \
  s_value += fma(fq, e1 - e0, e0);

// Elements of 64 bits must not halve the width of everything else.
#if LANES > 1 && defined(__clang__)
#define WIDE_VECTORS _Pragma("clang loop vectorize_width(16)")
#else
#define WIDE_VECTORS
#endif

// One pass over the rays for UNROLL slices: the sums stay in registers in between.
#define SLICES_OF(COUNT, LOAD, ADD)                          \
  WIDE_VECTORS                                               \
  for (int r = 0; r < LANES; ++r) {                          \
    float s_value = value[r];                                \
    LOAD_SUMS                                                \
    _Pragma("unroll") for (int i = 0; i < COUNT; ++i) {      \
      const float t = (float)(j + i) - centre_k;             \
      const int offset = (j + i) * stride_k;                 \
      POSITION LOAD() ADD()                                    \
    }                                                        \
    value[r] = s_value;                                      \
    STORE_SUMS                                               \
  }
#define UNROLL 4

// A CT that is larger than the caches is waited for: slices lie pages apart, which no hardware foresees. So a CPU asks
// for what it will need; OpenCL's own prefetch() may do nothing. A cache line is 16 words.
#if LANES > 1 && defined(__clang__)
#define PREFETCH_WORDS (1 << 22)
#define PREFETCH_POINT(r, slice)                                                            \
  {                                                                                         \
    const int next = min(slice, j_end - 1);                                                 \
    const float t = (float)next - centre_k;                                                 \
    const int ip = (int)clamp(fma(t, m_p[r], p_c[r]), 0.0f, p_max);                         \
    const int iq = (int)clamp(fma(t, m_q[r], q_c[r]), 0.0f, q_max);                         \
    const int index = ip * stride_p + iq * stride_q + next * stride_k;                      \
    __builtin_prefetch(PREFETCHED(index));                                                  \
  }
#if VOXELS_16
#define PREFETCHED(index) \
  (in_voxels ? (const void*)(ulong)(voxels + (index)) : (const void*)(ulong)(volume + (index)))
#else
#define PREFETCHED(index) ((const void*)(ulong)(volume + (index)))
#endif
// Along x a line holds 16 slices of one ray: a quarter of the rays each time. Else it holds a row of the tile: the rows'
// ends, for every slice.
#define PREFETCH_AFTER(j)                                                                               \
  if (grid.size_x * grid.size_y * grid.size_z > PREFETCH_WORDS) {                                       \
    for (int point = 0; point < 16; ++point) {                                                          \
      if (k == 0) PREFETCH_POINT(4 * point + ((j) / UNROLL & 3), (j) + 16)                              \
      else for (int i = 0; i < UNROLL; ++i) PREFETCH_POINT((point >> 1) * TILE + (point & 1) * (TILE - 1), (j) + UNROLL + i) \
    }                                                                                                   \
  }
#else
#define PREFETCH_AFTER(j)
#endif

#define MARCH(LOAD, ADD)                                                     \
  {                                                                          \
    int j = j_begin;                                                         \
    for (; j + UNROLL <= j_end; j += UNROLL) {                               \
      PREFETCH_AFTER(j)                                                      \
      SLICES_OF(UNROLL, LOAD, ADD)                                           \
    }                                                                        \
    for (; j < j_end; ++j) { SLICES_OF(1, LOAD, ADD) }                       \
  }

#define MARCH_ALONG(K, ADD)                           \
  {                                                   \
    if (in_voxels) MARCH(LOAD_VOXELS, ADD)            \
    else if (K == 2) MARCH(LOAD_SINGLE, ADD)          \
    else if (K == 1) MARCH(LOAD_PAIRED_AND_NEXT, ADD) \
    else MARCH(LOAD_PAIRED, ADD)                      \
  }

// Everything a render kernel starts with: tile, plan, rays, this work-item's share of the slices.
#define PREPARE_RAYS                                                                          \
  const int first_ray = (get_local_id(0) % ITEMS) * LANES;                                    \
  const int part = get_local_id(0) / ITEMS;                                                   \
  const int tile = get_group_id(0) % tiles;                                                   \
  const int pose_index = get_group_id(0) / tiles;                                             \
  __global const float* pose = poses + pose_index * POSE_STRIDE;                              \
  const int4 plan_of_tile = plans[get_group_id(0)];                                           \
  const int k = plan_of_tile.x;                                                               \
  const int2 origin = tile_origin(tile, tiles_x);                                             \
  const int a = (k + 1) % 3, b = (k + 2) % 3;                                                 \
  const int in_voxels = IN_VOXELS;                                                            \
  __global const ushort* voxels =                                                             \
      (__global const ushort*)(volume + grid.size_x * grid.size_y * grid.size_z);             \
  const int p_axis = k == 0 ? b : a, q_axis = k == 0 ? a : b;                                 \
  const float3 centre = (float3)(grid.centre_x, grid.centre_y, grid.centre_z);                \
  const int3 size = (int3)(grid.size_x, grid.size_y, grid.size_z);                            \
  const int3 strides = (int3)(1, grid.size_x, grid.size_x * grid.size_y);                     \
  const float centre_k = component_f(centre, k);                                              \
  const float p_max = (float)(component_i(size, p_axis) - 2);                                 \
  const float q_max = (float)(component_i(size, q_axis) - 2);                                 \
  const int stride_p = component_i(strides, p_axis), stride_q = component_i(strides, q_axis); \
  const int stride_k = component_i(strides, k);                                               \
  const int share = (plan_of_tile.z - plan_of_tile.y + SPLIT) / SPLIT;                        \
  const int j_begin = plan_of_tile.y + part * share;                                          \
  const int j_end = min(j_begin + share, plan_of_tile.z + 1);                                 \
  float p_c[LANES], m_p[LANES], q_c[LANES], m_q[LANES];                                       \
  for (int r = 0; r < LANES; ++r) {                                                           \
    const float u = RAY_U(first_ray + r), v = RAY_V(first_ray + r);                           \
    const float inv_dk = 1.0f / away_from_zero(linear(pose + P_DIRECTION + 3 * k, u, v));     \
    /* (source × direction): a_c = -cross_b / d_k, b_c = cross_a / d_k */                     \
    const float a_c = -linear(pose + P_CROSS + 3 * b, u, v) * inv_dk + component_f(centre, a); \
    const float b_c = linear(pose + P_CROSS + 3 * a, u, v) * inv_dk + component_f(centre, b); \
    p_c[r] = k == 0 ? b_c : a_c;                                                              \
    q_c[r] = k == 0 ? a_c : b_c;                                                              \
    m_p[r] = linear(pose + P_DIRECTION + 3 * p_axis, u, v) * inv_dk;                          \
    m_q[r] = linear(pose + P_DIRECTION + 3 * q_axis, u, v) * inv_dk;                          \
  }

#define RAY_COLUMN(ray) (origin.x + (int)((uint)(ray) % TILE))
#define RAY_ROW(ray) (origin.y + (int)((uint)(ray) / TILE))
#define RAY_U(ray) ((float)RAY_COLUMN(ray) - pose[P_MID_U])
#define RAY_V(ray) ((float)RAY_ROW(ray) - pose[P_MID_V])

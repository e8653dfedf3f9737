// The fast method's device side: Joseph's projector with exact derivatives, windowed sums, normal equations.
// OpenCL C 1.2. A tile is 8 × 8 pixels: one work-group renders it. Compile-time constants:
//   LANES  rays that one work-item renders in an inner loop: 64 on a CPU, whose compiler turns that loop into vector
//          instructions (one work-item per group), 1 on a GPU (64 work-items per group)
//   SPLIT  work-items that share one ray, each a part of the slices: 1, 2 or 4; more than 1 only with LANES 1
// All loop bounds come from the plan, so they are uniform in a group.

#ifndef LANES
#define LANES 1
#endif
#ifndef SPLIT
#define SPLIT 1
#endif
#define TILE 8
#define RAYS 64
#define ITEMS (RAYS / LANES)
#define GROUP (ITEMS * SPLIT)
#define POSE_STRIDE 64
#define SUMS 45
#define SUM_STRIDE 48
#define VECTOR 9
#define TERMS 56
#define BRICK 8

// Calls would keep the loops over rays from becoming vector code.
#define INLINE static inline __attribute__((always_inline))

// Layout of one pose's parameters; src/drr/pose_parameters.cpp writes the same.
#define P_DIRECTION 0   // 3 × 3: ray direction in voxels, linear in (u, v, 1)
#define P_CROSS 9       // 3 × 3: (source × direction), linear in (u, v, 1); source relative to the box centre
#define P_ROTATION 18   // 3 × 3: camera mm → voxels
#define P_SOURCE 27     // 3: source relative to the box centre, voxels
#define P_DSOURCE 30    // 6 × 3: derivative of the source by each component of the twist
#define P_SCALE 48      // voxel value → 1/mm
#define P_INV_FX 49
#define P_INV_FY 50
#define P_CX 51         // principal point relative to the image's middle
#define P_CY 52
#define P_MID_U 53      // the image's middle, pixels
#define P_MID_V 54

typedef struct {
  int size_x, size_y, size_z;        // padded voxels
  int bricks_x, bricks_y, bricks_z;  // occupancy grid
  float centre_x, centre_y, centre_z;  // box centre, padded index
  int unused;
} Grid;

INLINE float linear(__global const float* m, float u, float v) { return fma(m[0], u, fma(m[1], v, m[2])); }

INLINE int component_i(int3 v, int axis) { return axis == 0 ? v.x : (axis == 1 ? v.y : v.z); }
INLINE float component_f(float3 v, int axis) { return axis == 0 ? v.x : (axis == 1 ? v.y : v.z); }

// Tile's image origin. Tiles run row by row.
INLINE int2 tile_origin(int tile, int tiles_x) { return (int2)((tile % tiles_x) * TILE, (tile / tiles_x) * TILE); }

// A direction component that is safe to divide by; without a branch, so that loops over rays stay vector code.
INLINE float away_from_zero(float d) { return copysign(fmax(fabs(d), 1e-7f), d); }

// ---------------------------------------------------------------------------------------------------------------
// Plan: per tile the dominant axis and the range of slices that can hold tissue, from the occupancy grid.
typedef struct {
  float m_a[4], m_b[4], a_c[4], b_c[4];  // the tile's corner rays
} Corners;

// Whether a brick of slices, seen through the tile, touches tissue. The in-slice coordinates are ratios of linear
// functions of the pixel and linear in the slice, so their extremes over tile and brick are at the corners.
INLINE int touches_tissue(__global const uchar* occupancy, const Grid grid, const Corners* corners, int k, int brick) {
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const int3 size = (int3)(grid.size_x, grid.size_y, grid.size_z);
  const int3 bricks = (int3)(grid.bricks_x, grid.bricks_y, grid.bricks_z);
  const float centre_k = component_f((float3)(grid.centre_x, grid.centre_y, grid.centre_z), k);
  const float j_low = (float)(brick * BRICK) - centre_k;
  const float j_high = (float)(min(brick * BRICK + BRICK, component_i(size, k)) - 1) - centre_k;
  float a_low = 1e30f, a_high = -1e30f, b_low = 1e30f, b_high = -1e30f;
  for (int corner = 0; corner < 4; ++corner) {
    const float a1 = fma(j_low, corners->m_a[corner], corners->a_c[corner]);
    const float a2 = fma(j_high, corners->m_a[corner], corners->a_c[corner]);
    const float b1 = fma(j_low, corners->m_b[corner], corners->b_c[corner]);
    const float b2 = fma(j_high, corners->m_b[corner], corners->b_c[corner]);
    a_low = fmin(a_low, fmin(a1, a2));
    a_high = fmax(a_high, fmax(a1, a2));
    b_low = fmin(b_low, fmin(b1, b2));
    b_high = fmax(b_high, fmax(b1, b2));
  }
  // A hundredth of a voxel covers the rounding of the march's own coordinates.
  const int a_first = (int)(fmax(a_low - 0.01f, 0.0f)) / BRICK;
  const int a_last = a_high < 0.0f ? -1 : (int)fmin(a_high + 0.01f, (float)(component_i(size, a) - 1)) / BRICK;
  const int b_first = (int)(fmax(b_low - 0.01f, 0.0f)) / BRICK;
  const int b_last = b_high < 0.0f ? -1 : (int)fmin(b_high + 0.01f, (float)(component_i(size, b) - 1)) / BRICK;
  const int3 stride = (int3)(1, bricks.x, bricks.x * bricks.y);
  const int stride_a = component_i(stride, a), stride_b = component_i(stride, b);
  const int start = brick * component_i(stride, k);
  for (int ib = b_first; ib <= b_last; ++ib) {
    for (int ia = a_first; ia <= a_last; ++ia) {
      if (occupancy[start + ia * stride_a + ib * stride_b]) return 1;
    }
  }
  return 0;
}

// One group per (tile, pose). With LANES 1 its work-items test the bricks side by side, else one looks from both ends.
__kernel void plan(__global const uchar* occupancy, const Grid grid, __global const float* poses, const int tiles_x,
                   const int tiles, __global const int* tile_used, __global int4* plans) {
  __local int first, last;
  const int lid = get_local_id(0);
  const int tile = get_group_id(0) % tiles;
  __global const float* pose = poses + (get_group_id(0) / tiles) * POSE_STRIDE;
  const int2 origin = tile_origin(tile, tiles_x);
  const float u0 = (float)origin.x - pose[P_MID_U];
  const float v0 = (float)origin.y - pose[P_MID_V];
  const int used = tile_used[tile];

  const float um = u0 + 0.5f * (TILE - 1), vm = v0 + 0.5f * (TILE - 1);
  const float3 middle = (float3)(linear(pose + P_DIRECTION, um, vm), linear(pose + P_DIRECTION + 3, um, vm),
                                 linear(pose + P_DIRECTION + 6, um, vm));
  const float3 size_of = fabs(middle);
  const int k = (size_of.x >= size_of.y && size_of.x >= size_of.z) ? 0 : (size_of.y >= size_of.z ? 1 : 2);
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const float3 centre = (float3)(grid.centre_x, grid.centre_y, grid.centre_z);
  Corners corners;
  for (int corner = 0; corner < 4; ++corner) {
    const float u = u0 + ((corner & 1) ? (float)(TILE - 1) : 0.0f);
    const float v = v0 + ((corner & 2) ? (float)(TILE - 1) : 0.0f);
    const float inv_dk = 1.0f / away_from_zero(linear(pose + P_DIRECTION + 3 * k, u, v));
    corners.m_a[corner] = linear(pose + P_DIRECTION + 3 * a, u, v) * inv_dk;
    corners.m_b[corner] = linear(pose + P_DIRECTION + 3 * b, u, v) * inv_dk;
    corners.a_c[corner] = -linear(pose + P_CROSS + 3 * b, u, v) * inv_dk + component_f(centre, a);
    corners.b_c[corner] = linear(pose + P_CROSS + 3 * a, u, v) * inv_dk + component_f(centre, b);
  }
  const int bricks_k = component_i((int3)(grid.bricks_x, grid.bricks_y, grid.bricks_z), k);

  if (lid == 0) {
    first = bricks_k;
    last = -1;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
#if LANES > 1
  if (used) {
    int low = 0, high = bricks_k - 1;
    while (low < bricks_k && !touches_tissue(occupancy, grid, &corners, k, low)) ++low;
    while (high > low && !touches_tissue(occupancy, grid, &corners, k, high)) --high;
    first = low;
    last = low < bricks_k ? high : -1;
  }
#else
  for (int brick = lid; brick < bricks_k && used; brick += get_local_size(0)) {
    if (touches_tissue(occupancy, grid, &corners, k, brick)) {
      atomic_min(&first, brick);
      atomic_max(&last, brick);
    }
  }
#endif
  barrier(CLK_LOCAL_MEM_FENCE);
  if (lid == 0) {
    int j0 = 0, j1 = -1;
    if (first <= last) {
      j0 = first * BRICK;
      j1 = min(last * BRICK + BRICK, component_i((int3)(grid.size_x, grid.size_y, grid.size_z), k)) - 1;
      // Only what lies in front of the source counts; the source may be inside the volume.
      const float source_slice = clamp(pose[P_SOURCE + k] + component_f(centre, k), -1e6f, 1e6f);
      if (component_f(middle, k) >= 0.0f) j0 = max(j0, (int)ceil(source_slice));
      else j1 = min(j1, (int)floor(source_slice));
    }
    plans[get_group_id(0)] = (int4)(k, j0, j1, used);
  }
}

// ---------------------------------------------------------------------------------------------------------------
// The march. In-slice axes are named p (the axis whose neighbours share a word: z, unless z is the dominant axis) and
// q. Coordinates are padded voxel indices; two layers of air around the box let a clamp replace a branch: a clamped
// sample lies between two air voxels, so value and derivatives are zero.
//
// For dominant axis k the cyclic in-slice axes are a = k + 1, b = k + 2. The pair axis z is b for k = 0, a for k = 1;
// for k = 2 there is none and p = a. The words of neighbours in x stand side by side: that is q for k = 1, p for k = 2.

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

#define LOW(word) ((float)(int)((word) & 0xffffu))
#define HIGH(word) ((float)(int)((word) >> 16))

#define POSITION                                              \
  const float p = clamp(fma(t, m_p[r], p_c[r]), 0.0f, p_max); \
  const float q = clamp(fma(t, m_q[r], q_c[r]), 0.0f, q_max); \
  const int ip = (int)p, iq = (int)q;                         \
  const float fp = p - (float)ip, fq = q - (float)iq;         \
  const int index = ip * stride_p + iq * stride_q + offset;

#define LOAD_PAIRED()                            \
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
    __global const uint* word = volume + (ip * stride_p + iq * stride_q + next * stride_k); \
    __builtin_prefetch((const void*)(ulong)word);                                           \
  }
// Along x a line holds 16 slices of one ray: a quarter of the rays each time. Else it holds a row of the tile: the rows'
// ends, for every slice.
#define PREFETCH_AFTER(j)                                                                               \
  if (grid.size_x * grid.size_y * grid.size_z > PREFETCH_WORDS) {                                       \
    for (int point = 0; point < 16; ++point) {                                                          \
      if (k == 0) PREFETCH_POINT(4 * point + ((j) / UNROLL & 3), (j) + 16)                              \
      else for (int i = 0; i < UNROLL; ++i) PREFETCH_POINT((point >> 1) * 8 + (point & 1) * 7, (j) + UNROLL + i) \
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

#define MARCH_ALONG(K, ADD)                          \
  {                                                  \
    if (K == 2) MARCH(LOAD_SINGLE, ADD)              \
    else if (K == 1) MARCH(LOAD_PAIRED_AND_NEXT, ADD) \
    else MARCH(LOAD_PAIRED, ADD)                     \
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

#define RAY_COLUMN(ray) (origin.x + ((ray) & 7))
#define RAY_ROW(ray) (origin.y + ((ray) >> 3))
#define RAY_U(ray) ((float)RAY_COLUMN(ray) - pose[P_MID_U])
#define RAY_V(ray) ((float)RAY_ROW(ray) - pose[P_MID_V])

// ---------------------------------------------------------------------------------------------------------------
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

// ---------------------------------------------------------------------------------------------------------------
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
  __local float vectors[VECTOR * RAYS];
  __local float weighted[VECTOR * RAYS];
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

// ---------------------------------------------------------------------------------------------------------------
// Windows of span_x × span_y tiles, one work-item each: local normalised correlation, its exact gradient, its Gauss-Newton
// matrix. docs/design.md has the formulae. terms: 0…20 upper triangle of A, 21…26 b, 27 cost, 28 weight,
// 29 content · correlation, 30 content of windows that correlate, 31 content, 32…52 upper triangle of Σ b bᵀ.
// A window that correlates better than this shows the CT.
#define INLIER_CORRELATION 0.4f

#define PAIR(i, j) ((i) * VECTOR - (i) * ((i) - 1) / 2 + (j) - (i))

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
    terms[(21 + i) * RAYS + lid] = -slope * inv_x * inv_v * (grad_x - cov * grad_v[i] * inv_v2);
  }
  // Gauss-Newton of two unit vectors' distance, times the correlation: that is the curvature of 1 - correlation where
  // the window does not match well, and without it the steps there are too short.
  const float curvature = slope * inv_v2 * clamp(correlation, 0.1f, 1.0f);
  int term = 0;
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
  terms[27 * RAYS + lid] = importance * e * shrink;
  terms[28 * RAYS + lid] = importance;
  terms[29 * RAYS + lid] = counts ? n * content * correlation : 0.0f;
  terms[30 * RAYS + lid] = counts ? n * content * (correlation > INLIER_CORRELATION ? 1.0f : 0.0f) : 0.0f;
  terms[31 * RAYS + lid] = counts ? n * content : 0.0f;
  if (inside) correlations[pose_index * windows_x * windows_y + window] = counts && content > 0.5f ? correlation : -2.0f;
  // The scatter of the windows' gradients: what noise and model errors do to their sum.
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      terms[(term + 11) * RAYS + lid] = terms[(21 + i) * RAYS + lid] * terms[(21 + j) * RAYS + lid];
      ++term;
    }
  }
  for (int i = 53; i < TERMS; ++i) terms[i * RAYS + lid] = 0.0f;
  barrier(CLK_LOCAL_MEM_FENCE);
  if (lid < TERMS) {
    float total = 0.0f;
    for (int i = 0; i < RAYS; ++i) total += terms[lid * RAYS + i];
    terms_out[get_group_id(0) * TERMS + lid] = total;
  }
}

// ---------------------------------------------------------------------------------------------------------------
// X-ray pyramid: weighted mean over 2 × 2 pixels; the weight is the mean weight, zero below a half.
__kernel void halve_xray(__global const float* xray, __global const float* weight, const int width, const int height,
                         const int half_width, const int half_height, __global float* half_xray,
                         __global float* half_weight) {
  const int i = get_global_id(0);
  if (i >= half_width * half_height) return;
  const int u = 2 * (i % half_width), v = 2 * (i / half_width);
  float total = 0.0f, total_weight = 0.0f, plain = 0.0f;
  for (int dv = 0; dv < 2; ++dv) {
    for (int du = 0; du < 2; ++du) {
      const int pixel = (v + dv) * width + u + du;
      total = fma(weight[pixel], xray[pixel], total);
      total_weight += weight[pixel];
      plain += xray[pixel];
    }
  }
  half_xray[i] = total_weight > 0.0f ? total / total_weight : 0.25f * plain;
  half_weight[i] = total_weight >= 2.0f ? 0.25f * total_weight : 0.0f;
}

// Whether any pixel of a tile has weight, and how much the X-ray varies in it.
__kernel void used_tiles(__global const float* xray, __global const float* weight, const int width, const int height,
                         const int tiles_x, const int tiles, __global int* used, __global float* contrast) {
  const int tile = get_global_id(0);
  if (tile >= tiles) return;
  const int2 origin = tile_origin(tile, tiles_x);
  const float reference = xray[origin.y * width + origin.x];
  float n = 0.0f, sum = 0.0f, sum2 = 0.0f;
  for (int v = origin.y; v < min(origin.y + TILE, height); ++v) {
    for (int u = origin.x; u < min(origin.x + TILE, width); ++u) {
      const float w = weight[v * width + u], x = xray[v * width + u] - reference;
      n += w;
      sum += w * x;
      sum2 += w * x * x;
    }
  }
  used[tile] = n > 0.0f;
  contrast[tile] = n > 0.0f ? fmax(sum2 / n - sum * sum / (n * n), 0.0f) : 0.0f;
}

// ---------------------------------------------------------------------------------------------------------------
// What the CT cannot explain: where a ray leaves the volume through a cut face, the face's tissue is taken to go on
// without end, and its line integral U tells how much of the X-ray has no CT behind it. One work-item per point of a
// coarse map over the image; weight 1 / (1 + (U / limit)²), so that nothing jumps.
__kernel void unexplained(__global const uint* volume, const Grid grid, __global const float* pose, const int map_width,
                          const int map_height, const float map_step, const int cut_faces, const float radius_voxels,
                          const float limit, __global float* map) {
  const int i = get_global_id(0);
  if (i >= map_width * map_height) return;
  const float u = (float)(i % map_width) * map_step - pose[P_MID_U];
  const float v = (float)(i / map_width) * map_step - pose[P_MID_V];
  const float3 direction = (float3)(linear(pose + P_DIRECTION, u, v), linear(pose + P_DIRECTION + 3, u, v),
                                    linear(pose + P_DIRECTION + 6, u, v));
  const float3 source = (float3)(pose[P_SOURCE], pose[P_SOURCE + 1], pose[P_SOURCE + 2]);
  const float3 centre = (float3)(grid.centre_x, grid.centre_y, grid.centre_z);
  const float inv_length = 1.0f / length(direction);
  const float d_x = (u - pose[P_CX]) * pose[P_INV_FX], d_y = (v - pose[P_CY]) * pose[P_INV_FY];
  const float mm_per_voxel = sqrt(d_x * d_x + d_y * d_y + 1.0f) * inv_length;
  // From where the ray is nearest to the box centre, one radius to both sides.
  const float nearest = -dot(source, direction) * inv_length * inv_length;
  const float first = fmax(nearest - radius_voxels * inv_length, 0.0f);
  const float last = fmax(nearest + radius_voxels * inv_length, 0.0f);
  const int steps = 96;
  const float step = (last - first) / (float)steps;
  const int low = 2;  // First voxel of the box behind its padding.
  const int3 high = (int3)(grid.size_x - 3, grid.size_y - 3, grid.size_z - 3);
  float total = 0.0f;
  for (int s = 0; s < steps; ++s) {
    const float3 p = source + (first + ((float)s + 0.5f) * step) * direction + centre;
    const int3 at = convert_int3_rtn(p + 0.5f);
    const int below_x = at.x < low, above_x = at.x > high.x;
    const int below_y = at.y < low, above_y = at.y > high.y;
    const int below_z = at.z < low, above_z = at.z > high.z;
    const int outside = (below_x ? 1 : 0) | (above_x ? 2 : 0) | (below_y ? 4 : 0) | (above_y ? 8 : 0) |
                        (below_z ? 16 : 0) | (above_z ? 32 : 0);
    // Behind cut faces alone the body goes on; beside the body there is air.
    const int counts = outside != 0 && (outside & ~cut_faces) == 0;
    const int index = (clamp(at.z, low, high.z) * grid.size_y + clamp(at.y, low, high.y)) * grid.size_x +
                      clamp(at.x, low, high.x);
    total += counts ? LOW(volume[index]) : 0.0f;
  }
  const float integral = total * step / inv_length * mm_per_voxel * pose[P_SCALE];
  const float ratio = integral / limit;
  map[i] = 1.0f / (1.0f + ratio * ratio);
}

// weight = mask · map, the map interpolated between its points; below a twentieth it is nothing.
__kernel void apply_map(__global const float* mask, __global const float* map, const int width, const int height,
                        const int map_width, const int map_height, const float map_step, __global float* weight) {
  const int i = get_global_id(0);
  if (i >= width * height) return;
  const float x = fmin((float)(i % width) / map_step, (float)(map_width - 1) - 0.001f);
  const float y = fmin((float)(i / width) / map_step, (float)(map_height - 1) - 0.001f);
  const int ix = (int)x, iy = (int)y;
  const float fx = x - (float)ix, fy = y - (float)iy;
  __global const float* m = map + iy * map_width + ix;
  const float top = mix(m[0], m[1], fx), bottom = mix(m[map_width], m[map_width + 1], fx);
  const float w = mix(top, bottom, fy);
  weight[i] = mask[i] * (w < 0.05f ? 0.0f : w);
}

// The fast method's device side: Joseph's projector with exact derivatives, windowed sums, normal equations.
// OpenCL C 1.2. Compile-time constants: SPLIT (work-items that share one ray), 1 … 4.
//
// A tile is 8 × 8 pixels: one work-group of 64 · SPLIT work-items renders it. All loop bounds come from the plan, so
// they are uniform in a group.

#ifndef SPLIT
#define SPLIT 1
#endif
#define TILE 8
#define RAYS 64
#define GROUP (RAYS * SPLIT)
#define POSE_STRIDE 64
#define SUMS 45
#define SUM_STRIDE 48
#define VECTOR 9
#define TERMS 32
#define BRICK 8

// Layout of one pose's parameters; src/drr/pose_parameters.h writes the same.
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

inline float linear(__global const float* m, float u, float v) { return fma(m[0], u, fma(m[1], v, m[2])); }

inline int component_i(int3 v, int axis) { return axis == 0 ? v.x : (axis == 1 ? v.y : v.z); }
inline float component_f(float3 v, int axis) { return axis == 0 ? v.x : (axis == 1 ? v.y : v.z); }

// Tile's image origin. Tiles run row by row.
inline int2 tile_origin(int tile, int tiles_x) { return (int2)((tile % tiles_x) * TILE, (tile / tiles_x) * TILE); }

// ---------------------------------------------------------------------------------------------------------------
// Plan: per tile the dominant axis and the range of slices that can hold tissue. One group per (tile, pose); each
// work-item tests bricks of slices against the occupancy grid.
__kernel __attribute__((reqd_work_group_size(RAYS, 1, 1)))
void plan(__global const uchar* occupancy, const Grid grid, __global const float* poses, const int tiles_x,
          const int tiles, const int first_pose, __global const int* tile_used, __global int4* plans) {
  __local int first, last;
  const int lid = get_local_id(0);
  const int tile = get_group_id(0) % tiles;
  const int pose_index = get_group_id(0) / tiles;
  __global const float* pose = poses + (first_pose + pose_index) * POSE_STRIDE;
  const int2 origin = tile_origin(tile, tiles_x);
  const float u0 = (float)origin.x - pose[P_MID_U];
  const float v0 = (float)origin.y - pose[P_MID_V];
  const int used = tile_used[tile];

  const float um = u0 + 0.5f * (TILE - 1), vm = v0 + 0.5f * (TILE - 1);
  const float3 dm = (float3)(linear(pose + P_DIRECTION, um, vm), linear(pose + P_DIRECTION + 3, um, vm),
                             linear(pose + P_DIRECTION + 6, um, vm));
  const float3 ad = fabs(dm);
  const int k = (ad.x >= ad.y && ad.x >= ad.z) ? 0 : (ad.y >= ad.z ? 1 : 2);
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const int3 size = (int3)(grid.size_x, grid.size_y, grid.size_z);
  const int3 bricks = (int3)(grid.bricks_x, grid.bricks_y, grid.bricks_z);
  const float3 centre = (float3)(grid.centre_x, grid.centre_y, grid.centre_z);
  const float ck = component_f(centre, k), ca = component_f(centre, a), cb = component_f(centre, b);
  const float source_k = pose[P_SOURCE + k];
  const float forward = component_f(dm, k) >= 0.0f ? 1.0f : -1.0f;

  if (lid == 0) {
    first = INT_MAX;
    last = INT_MIN;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  const int bricks_k = component_i(bricks, k);
  for (int brick = lid; brick < bricks_k; brick += RAYS) {
    // Interval of both in-slice coordinates over the tile's corners and the brick's end slices: the coordinates are
    // ratios of linear functions of the pixel and linear in the slice, so the extremes are at the corners.
    const float j_low = (float)(brick * BRICK) - ck;
    const float j_high = (float)(min(brick * BRICK + BRICK - 1, component_i(size, k) - 1)) - ck;
    float a_low = 1e30f, a_high = -1e30f, b_low = 1e30f, b_high = -1e30f;
    for (int corner = 0; corner < 4; ++corner) {
      const float u = u0 + ((corner & 1) ? (float)(TILE - 1) : 0.0f);
      const float v = v0 + ((corner & 2) ? (float)(TILE - 1) : 0.0f);
      const float dk_raw = linear(pose + P_DIRECTION + 3 * k, u, v);
      const float inv_dk = 1.0f / (fabs(dk_raw) < 1e-7f ? 1e-7f * forward : dk_raw);
      const float m_a = linear(pose + P_DIRECTION + 3 * a, u, v) * inv_dk;
      const float m_b = linear(pose + P_DIRECTION + 3 * b, u, v) * inv_dk;
      const float a_c = -linear(pose + P_CROSS + 3 * b, u, v) * inv_dk + ca;
      const float b_c = linear(pose + P_CROSS + 3 * a, u, v) * inv_dk + cb;
      const float a1 = fma(j_low, m_a, a_c), a2 = fma(j_high, m_a, a_c);
      const float b1 = fma(j_low, m_b, b_c), b2 = fma(j_high, m_b, b_c);
      a_low = fmin(a_low, fmin(a1, a2));
      a_high = fmax(a_high, fmax(a1, a2));
      b_low = fmin(b_low, fmin(b1, b2));
      b_high = fmax(b_high, fmax(b1, b2));
    }
    const int bricks_a = component_i(bricks, a), bricks_b = component_i(bricks, b);
    // A hundredth of a voxel covers the rounding of the march's own coordinates.
    const int a_first = (int)floor((fmax(a_low - 0.01f, 0.0f)) / BRICK);
    const int a_last = (int)floor(fmin(a_high + 0.01f, (float)(bricks_a * BRICK - 1)) / BRICK);
    const int b_first = (int)floor((fmax(b_low - 0.01f, 0.0f)) / BRICK);
    const int b_last = (int)floor(fmin(b_high + 0.01f, (float)(bricks_b * BRICK - 1)) / BRICK);
    int found = 0;
    for (int ib = b_first; ib <= b_last; ++ib) {
      for (int ia = a_first; ia <= a_last; ++ia) {
        const int x = k == 0 ? brick : (a == 0 ? ia : ib);
        const int y = k == 1 ? brick : (a == 1 ? ia : ib);
        const int z = k == 2 ? brick : (a == 2 ? ia : ib);
        found |= occupancy[(z * grid.bricks_y + y) * grid.bricks_x + x];
      }
    }
    if (found) {
      atomic_min(&first, brick);
      atomic_max(&last, brick);
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (lid == 0) {
    int j0 = 0, j1 = -1;
    if (used && first <= last) {
      j0 = first * BRICK;
      j1 = min(last * BRICK + BRICK, component_i(size, k)) - 1;
      // Only what lies in front of the source counts; the source may be inside the volume.
      const float source_slice = clamp(source_k + ck, -1e6f, 1e6f);
      if (forward > 0.0f) j0 = max(j0, (int)ceil(source_slice));
      else j1 = min(j1, (int)floor(source_slice));
    }
    plans[get_group_id(0)] = (int4)(k, j0, j1, used);
  }
}

// ---------------------------------------------------------------------------------------------------------------
// One ray's march. In-slice axes are named p (the axis whose neighbours share a word: z, unless z is the dominant
// axis) and q. Coordinates are padded voxel indices; two layers of air around the box let a clamp replace a branch:
// a clamped sample lies between two air voxels, so value and derivatives are zero.
typedef struct {
  float value, dp, dq, jdp, jdq;
} MarchSums;

typedef struct {
  float p_c, m_p, p_max;
  float q_c, m_q, q_max;
  float centre_k;
  int stride_p, stride_q, stride_k;
} MarchRay;

#define MARCH_POSITION                                              \
  const float t = (float)j - ray.centre_k;                          \
  const float p = clamp(fma(t, ray.m_p, ray.p_c), 0.0f, ray.p_max); \
  const float q = clamp(fma(t, ray.m_q, ray.q_c), 0.0f, ray.q_max); \
  const int ip = (int)p, iq = (int)q;                               \
  const float fp = p - (float)ip, fq = q - (float)iq;               \
  const int index = ip * ray.stride_p + iq * ray.stride_q + j * ray.stride_k;

#define LOW(word) ((float)(int)((word) & 0xffffu))
#define HIGH(word) ((float)(int)((word) >> 16))

#define MARCH_PAIRED                                   \
  const uint word0 = volume[index];                    \
  const uint word1 = volume[index + ray.stride_q];     \
  const float v00 = LOW(word0), v01 = HIGH(word0), v10 = LOW(word1), v11 = HIGH(word1);

#define MARCH_SINGLE                                              \
  const float v00 = LOW(volume[index]);                           \
  const float v01 = LOW(volume[index + ray.stride_p]);            \
  const float v10 = LOW(volume[index + ray.stride_q]);            \
  const float v11 = LOW(volume[index + ray.stride_p + ray.stride_q]);

#define MARCH_ACCUMULATE                        \
  const float d0 = v01 - v00, d1 = v11 - v10;   \
  const float e0 = fma(fp, d0, v00);            \
  const float e1 = fma(fp, d1, v10);            \
  const float dq = e1 - e0;                     \
  const float dp = fma(fq, d1 - d0, d0);        \
  sums.value += fma(fq, dq, e0);                \
  sums.dp += dp;                                \
  sums.dq += dq;                                \
  sums.jdp = fma(t, dp, sums.jdp);              \
  sums.jdq = fma(t, dq, sums.jdq);

#define MARCH_ACCUMULATE_VALUE                  \
  const float e0 = fma(fp, v01 - v00, v00);     \
  const float e1 = fma(fp, v11 - v10, v10);     \
  sums.value += fma(fq, e1 - e0, e0);

// What the chain rule needs of a ray besides the sums.
typedef struct {
  float3 direction;   // voxels
  float3 d_camera;    // camera axes, z = 1
  float inv_dk;
  float length_mm;    // between slices, along the ray
} RayGeometry;

inline RayGeometry ray_geometry(__global const float* pose, int k, float u, float v) {
  RayGeometry g;
  g.direction = (float3)(linear(pose + P_DIRECTION, u, v), linear(pose + P_DIRECTION + 3, u, v),
                         linear(pose + P_DIRECTION + 6, u, v));
  const float dk = component_f(g.direction, k);
  g.inv_dk = 1.0f / (fabs(dk) < 1e-7f ? 1e-7f : dk);
  g.d_camera = (float3)((u - pose[P_CX]) * pose[P_INV_FX], (v - pose[P_CY]) * pose[P_INV_FY], 1.0f);
  g.length_mm = sqrt(fma(g.d_camera.x, g.d_camera.x, fma(g.d_camera.y, g.d_camera.y, 1.0f))) * fabs(g.inv_dk);
  return g;
}

// For dominant axis k the cyclic in-slice axes are a = k + 1, b = k + 2. The pair axis is z = axis 2: it is b for
// k = 0, a for k = 1; for k = 2 there is none and p = a.
inline MarchRay march_ray(__global const float* pose, const Grid grid, int k, float u, float v, float inv_dk) {
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const float3 centre = (float3)(grid.centre_x, grid.centre_y, grid.centre_z);
  const int3 size = (int3)(grid.size_x, grid.size_y, grid.size_z);
  const int3 stride = (int3)(1, grid.size_x, grid.size_x * grid.size_y);
  const float m_a = linear(pose + P_DIRECTION + 3 * a, u, v) * inv_dk;
  const float m_b = linear(pose + P_DIRECTION + 3 * b, u, v) * inv_dk;
  const float a_c = -linear(pose + P_CROSS + 3 * b, u, v) * inv_dk + component_f(centre, a);
  const float b_c = linear(pose + P_CROSS + 3 * a, u, v) * inv_dk + component_f(centre, b);
  const int p_is_b = k == 0;
  MarchRay ray;
  ray.p_c = p_is_b ? b_c : a_c;
  ray.m_p = p_is_b ? m_b : m_a;
  ray.q_c = p_is_b ? a_c : b_c;
  ray.m_q = p_is_b ? m_a : m_b;
  ray.p_max = (float)(component_i(size, p_is_b ? b : a) - 2);
  ray.q_max = (float)(component_i(size, p_is_b ? a : b) - 2);
  ray.stride_p = component_i(stride, p_is_b ? b : a);
  ray.stride_q = component_i(stride, p_is_b ? a : b);
  ray.stride_k = component_i(stride, k);
  ray.centre_k = component_f(centre, k);
  return ray;
}

// The six partial derivatives of the line integral by the twist [v; ω], from the march's sums.
inline void chain_rule(__global const float* pose, int k, const RayGeometry g, const MarchSums s, float* partial) {
  const int a = (k + 1) % 3, b = (k + 2) % 3;
  const int p_is_b = k == 0;
  const float w = g.length_mm * pose[P_SCALE];
  const float sa = w * (p_is_b ? s.dq : s.dp), sb = w * (p_is_b ? s.dp : s.dq);
  const float ja = w * (p_is_b ? s.jdq : s.jdp), jb = w * (p_is_b ? s.jdp : s.jdq);
  const float value = w * s.value;
  const float m_a = component_f(g.direction, a) * g.inv_dk, m_b = component_f(g.direction, b) * g.inv_dk;
  const float source_k = pose[P_SOURCE + k];
  for (int i = 0; i < 3; ++i) {  // Translation moves the source alone.
    __global const float* ds = pose + P_DSOURCE + 3 * i;
    partial[i] = fma(fma(-ds[k], m_a, ds[a]), sa, fma(-ds[k], m_b, ds[b]) * sb);
  }
  for (int i = 0; i < 3; ++i) {  // Rotation moves source and direction: d(direction) = -G (e_i × d_camera).
    __global const float* ds = pose + P_DSOURCE + 9 + 3 * i;
    const float3 turned = i == 0 ? (float3)(0.0f, -g.d_camera.z, g.d_camera.y)
                                 : (i == 1 ? (float3)(g.d_camera.z, 0.0f, -g.d_camera.x)
                                           : (float3)(-g.d_camera.y, g.d_camera.x, 0.0f));
    __global const float* rotation = pose + P_ROTATION;
    const float dd_k = -(rotation[3 * k] * turned.x + rotation[3 * k + 1] * turned.y + rotation[3 * k + 2] * turned.z);
    const float dd_a = -(rotation[3 * a] * turned.x + rotation[3 * a + 1] * turned.y + rotation[3 * a + 2] * turned.z);
    const float dd_b = -(rotation[3 * b] * turned.x + rotation[3 * b + 1] * turned.y + rotation[3 * b + 2] * turned.z);
    const float dm_a = (dd_a - m_a * dd_k) * g.inv_dk;
    const float dm_b = (dd_b - m_b * dd_k) * g.inv_dk;
    partial[3 + i] = -dd_k * g.inv_dk * value + fma(-source_k, dm_a, fma(-ds[k], m_a, ds[a])) * sa + dm_a * ja +
                     fma(-source_k, dm_b, fma(-ds[k], m_b, ds[b])) * sb + dm_b * jb;
  }
}

// Slices of this work-item's share of a ray. With SPLIT = 1 all of them.
#define SHARE_OF_SLICES(part)                                     \
  const int slices = plan_of_tile.z - plan_of_tile.y + 1;         \
  const int share = (slices + SPLIT - 1) / SPLIT;                 \
  const int j_begin = plan_of_tile.y + (part) * share;            \
  const int j_end = SPLIT == 1 ? plan_of_tile.z + 1 : min(j_begin + share, plan_of_tile.z + 1);

// ---------------------------------------------------------------------------------------------------------------
// Value only: the DRR.
__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void render(__global const uint* volume, const Grid grid, __global const float* poses, __global const int4* plans,
            const int tiles_x, const int tiles, const int width, const int height, __global float* image) {
  const int ray_id = get_local_id(0) % RAYS;
  const int tile = get_group_id(0) % tiles;
  const int pose_index = get_group_id(0) / tiles;
  __global const float* pose = poses + pose_index * POSE_STRIDE;
  const int4 plan_of_tile = plans[get_group_id(0)];
  const int k = plan_of_tile.x;
  const int2 origin = tile_origin(tile, tiles_x);
  const int column = origin.x + (ray_id & 7), row = origin.y + (ray_id >> 3);
  const float u = (float)column - pose[P_MID_U], v = (float)row - pose[P_MID_V];
  const RayGeometry g = ray_geometry(pose, k, u, v);
  const MarchRay ray = march_ray(pose, grid, k, u, v, g.inv_dk);
  MarchSums sums = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
  SHARE_OF_SLICES(get_local_id(0) / RAYS)
  if (k == 2) {
    for (int j = j_begin; j < j_end; ++j) {
      MARCH_POSITION MARCH_SINGLE MARCH_ACCUMULATE_VALUE
    }
  } else {
    for (int j = j_begin; j < j_end; ++j) {
      MARCH_POSITION MARCH_PAIRED MARCH_ACCUMULATE_VALUE
    }
  }
#if SPLIT > 1
  __local float parts[GROUP];
  parts[get_local_id(0)] = sums.value;
  barrier(CLK_LOCAL_MEM_FENCE);
  if (get_local_id(0) < RAYS) {
    for (int part = 1; part < SPLIT; ++part) sums.value += parts[part * RAYS + ray_id];
  }
#endif
  if (get_local_id(0) < RAYS && column < width && row < height) {
    image[(pose_index * height + row) * width + column] = sums.value * g.length_mm * pose[P_SCALE];
  }
}

#define MARCH_WITH_DERIVATIVES                                   \
  MarchSums sums = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f};               \
  SHARE_OF_SLICES(get_local_id(0) / RAYS)                        \
  if (k == 2) {                                                  \
    for (int j = j_begin; j < j_end; ++j) {                      \
      MARCH_POSITION MARCH_SINGLE MARCH_ACCUMULATE               \
    }                                                            \
  } else {                                                       \
    for (int j = j_begin; j < j_end; ++j) {                      \
      MARCH_POSITION MARCH_PAIRED MARCH_ACCUMULATE               \
    }                                                            \
  }

#if SPLIT > 1
#define JOIN_PARTS                                                                        \
  __local float parts[5 * GROUP];                                                         \
  parts[get_local_id(0)] = sums.value;                                                    \
  parts[GROUP + get_local_id(0)] = sums.dp;                                               \
  parts[2 * GROUP + get_local_id(0)] = sums.dq;                                           \
  parts[3 * GROUP + get_local_id(0)] = sums.jdp;                                          \
  parts[4 * GROUP + get_local_id(0)] = sums.jdq;                                          \
  barrier(CLK_LOCAL_MEM_FENCE);                                                           \
  if (get_local_id(0) < RAYS) {                                                           \
    for (int part = 1; part < SPLIT; ++part) {                                            \
      sums.value += parts[part * RAYS + ray_id];                                          \
      sums.dp += parts[GROUP + part * RAYS + ray_id];                                     \
      sums.dq += parts[2 * GROUP + part * RAYS + ray_id];                                 \
      sums.jdp += parts[3 * GROUP + part * RAYS + ray_id];                                \
      sums.jdq += parts[4 * GROUP + part * RAYS + ray_id];                                \
    }                                                                                     \
  }
#else
#define JOIN_PARTS
#endif

// Value and derivatives as seven images, for tests and for whoever wants to look at them.
__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void render_derivatives(__global const uint* volume, const Grid grid, __global const float* poses,
                        __global const int4* plans, const int tiles_x, const int tiles, const int width,
                        const int height, __global float* images) {
  const int ray_id = get_local_id(0) % RAYS;
  const int tile = get_group_id(0) % tiles;
  __global const float* pose = poses;
  const int4 plan_of_tile = plans[get_group_id(0)];
  const int k = plan_of_tile.x;
  const int2 origin = tile_origin(tile, tiles_x);
  const int column = origin.x + (ray_id & 7), row = origin.y + (ray_id >> 3);
  const float u = (float)column - pose[P_MID_U], v = (float)row - pose[P_MID_V];
  const RayGeometry g = ray_geometry(pose, k, u, v);
  const MarchRay ray = march_ray(pose, grid, k, u, v, g.inv_dk);
  MARCH_WITH_DERIVATIVES
  JOIN_PARTS
  if (get_local_id(0) < RAYS && column < width && row < height) {
    float partial[6];
    chain_rule(pose, k, g, sums, partial);
    const int pixel = row * width + column;
    images[pixel] = sums.value * g.length_mm * pose[P_SCALE];
    for (int i = 0; i < 6; ++i) images[(i + 1) * width * height + pixel] = partial[i];
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
  __local float weights[RAYS];
  __local float reference[2];
  const int ray_id = get_local_id(0) % RAYS;
  const int tile = get_group_id(0) % tiles;
  const int pose_index = get_group_id(0) / tiles;
  __global const float* pose = poses + pose_index * POSE_STRIDE;
  const int4 plan_of_tile = plans[get_group_id(0)];
  const int k = plan_of_tile.x;
  const int2 origin = tile_origin(tile, tiles_x);
  const int column = origin.x + (ray_id & 7), row = origin.y + (ray_id >> 3);
  const float u = (float)column - pose[P_MID_U], v = (float)row - pose[P_MID_V];
  const RayGeometry g = ray_geometry(pose, k, u, v);
  const MarchRay ray = march_ray(pose, grid, k, u, v, g.inv_dk);
  MARCH_WITH_DERIVATIVES
  JOIN_PARTS
  const int pixel = min(row, height - 1) * width + min(column, width - 1);
  const float intensity = xray[pixel];
  const float value = sums.value * g.length_mm * pose[P_SCALE];
  if (get_local_id(0) == 0) {
    reference[0] = value;
    reference[1] = intensity;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (get_local_id(0) < RAYS) {
    float partial[6];
    chain_rule(pose, k, g, sums, partial);
    weights[ray_id] = (column < width && row < height) ? weight[pixel] : 0.0f;
    vectors[ray_id] = 1.0f;
    vectors[RAYS + ray_id] = value - reference[0];
    vectors[2 * RAYS + ray_id] = intensity - reference[1];
    for (int i = 0; i < 6; ++i) vectors[(3 + i) * RAYS + ray_id] = partial[i];
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (get_local_id(0) < SUMS) {
    const int first = kFirst[get_local_id(0)] * RAYS, second = kSecond[get_local_id(0)] * RAYS;
    float total = 0.0f;
    for (int i = 0; i < RAYS; ++i) total = fma(weights[i] * vectors[first + i], vectors[second + i], total);
    sums_out[get_group_id(0) * SUM_STRIDE + get_local_id(0)] = total;
  } else if (get_local_id(0) < SUMS + 2) {
    sums_out[get_group_id(0) * SUM_STRIDE + get_local_id(0)] = reference[get_local_id(0) - SUMS];
  }
}

// ---------------------------------------------------------------------------------------------------------------
// Windows of span_x × span_y tiles, one work-item each: local normalised correlation, its exact gradient, its Gauss-Newton
// matrix. docs/design.md has the formulae. terms: 0…20 upper triangle of A, 21…26 b, 27 cost, 28 weight,
// 29 weight · correlation, 30 weight of inlier windows, 31 windows.
#define PAIR(i, j) ((i) * VECTOR - (i) * ((i) - 1) / 2 + (j) - (i))

__kernel __attribute__((reqd_work_group_size(RAYS, 1, 1)))
void windows(__global const float* tile_sums_in, const int tiles_x, const int tiles_y, const int span_x,
             const int span_y, const int windows_x, const int windows_y, const int window_groups, const float epsilon_value2,
             const float epsilon_xray2, const float robust_scale2, const float contrast_power,
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
  const float importance = counts ? n * (contrast_power == 0.0f ? 1.0f : pow(var_x + epsilon_xray2, contrast_power)) : 0.0f;
  const float slope = importance * shrink * shrink;

  float grad_v[6], mean_g[6];
  for (int i = 0; i < 6; ++i) {
    mean_g[i] = s[PAIR(0, 3 + i)] * inv_n;
    grad_v[i] = s[PAIR(1, 3 + i)] * inv_n - mean_v * mean_g[i];
    const float grad_x = s[PAIR(2, 3 + i)] * inv_n - mean_x * mean_g[i];
    // Gradient of e.
    terms[(21 + i) * RAYS + lid] = -slope * inv_x * inv_v * (grad_x - cov * grad_v[i] * inv_v2);
  }
  int term = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      const float cov_g = s[PAIR(3 + i, 3 + j)] * inv_n - mean_g[i] * mean_g[j];
      const float normalisation = grad_v[i] * grad_v[j] * inv_v2 * (2.0f - var_v * inv_v2);
      terms[term * RAYS + lid] = slope * inv_v2 * (cov_g - normalisation);
      ++term;
    }
  }
  // Only windows with DRR content say anything about similarity.
  const float content = var_v * inv_v2;
  terms[27 * RAYS + lid] = importance * e * shrink;
  terms[28 * RAYS + lid] = importance;
  terms[29 * RAYS + lid] = counts ? n * content * correlation : 0.0f;
  terms[30 * RAYS + lid] = counts ? n * content * (shrink > 0.5f ? 1.0f : 0.0f) : 0.0f;
  terms[31 * RAYS + lid] = counts ? n * content : 0.0f;
  if (inside) correlations[pose_index * windows_x * windows_y + window] = counts ? correlation : -2.0f;
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

// Whether any pixel of a tile has weight.
__kernel void used_tiles(__global const float* weight, const int width, const int height, const int tiles_x,
                         const int tiles, __global int* used) {
  const int tile = get_global_id(0);
  if (tile >= tiles) return;
  const int2 origin = tile_origin(tile, tiles_x);
  int any = 0;
  for (int v = origin.y; v < min(origin.y + TILE, height); ++v) {
    for (int u = origin.x; u < min(origin.x + TILE, width); ++u) any |= weight[v * width + u] > 0.0f;
  }
  used[tile] = any;
}

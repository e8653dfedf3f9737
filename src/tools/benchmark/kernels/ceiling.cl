// What the march could reach at best. Compiled behind the engine's own kernels: rays, plan, positions and loop are
// march.cl's, so the access pattern stays the same when that one changes.

#undef LOAD_SUMS
#undef STORE_SUMS
#define LOAD_SUMS uint s_bits = bits[r];
#define STORE_SUMS bits[r] = s_bits;

#define WORDS_PAIRED()                         \
  const uint word0 = volume[index];            \
  const uint word1 = volume[index + stride_q]; \
  s_bits ^= word0 ^ word1;

#define WORDS_PAIRED_AND_NEXT()  \
  LOAD_TWO(word0, word1, index)  \
  s_bits ^= word0 ^ word1;

#define WORDS_SINGLE()                       \
  LOAD_TWO(word00, word01, index)            \
  LOAD_TWO(word10, word11, index + stride_q) \
  s_bits ^= word00 ^ word01 ^ word10 ^ word11;

#if VOXELS_16
#define WORDS_OF_VOXELS()                                                       \
  const uint word0 = TWO_VOXELS(index);              \
  const uint word1 = TWO_VOXELS(index + stride_q); \
  s_bits ^= word0 ^ word1;
#else
#define WORDS_OF_VOXELS WORDS_SINGLE
#endif

// The interpolation's parts are not used here.
#define ADD_NOTHING() (void)fp; (void)fq;

// The march's loads and nothing else: no conversion, no interpolation, no derivatives.
__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1)))
void loads_only(__global const uint* volume, const Grid grid, __global const float* poses, __global const int4* plans,
                const int tiles_x, const int tiles, __global uint* out) {
  PREPARE_RAYS
  float value[LANES];
  uint bits[LANES];
  for (int r = 0; r < LANES; ++r) {
    value[r] = 0.0f;
    bits[r] = 0u;
  }
  if (in_voxels) MARCH(WORDS_OF_VOXELS, ADD_NOTHING)
  else if (k == 2) MARCH(WORDS_SINGLE, ADD_NOTHING)
  else if (k == 1) MARCH(WORDS_PAIRED_AND_NEXT, ADD_NOTHING)
  else MARCH(WORDS_PAIRED, ADD_NOTHING)
  (void)part;
  (void)pose_index;
  for (int r = 0; r < LANES; ++r) out[get_group_id(0) * RAYS + first_ray + r] = bits[r] + (uint)value[r];
}

// Memory bandwidth: reads and writes each float once, `float16`s side by side.
__kernel void copy(__global const float16* from, __global float16* to) {
  to[get_global_id(0)] = from[get_global_id(0)];
}

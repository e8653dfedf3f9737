// What all kernels of the fast method share. OpenCL C 1.2. The texts of this folder are one program, in the order that
// fast_program.cpp gives. Sizes and layouts come by -D from opencl/layout.h, and
//   LANES  rays that one work-item renders in an inner loop: 64 on a CPU, whose compiler turns that loop into vector
//          instructions (one work-item per group), 1 on a GPU (64 work-items per group)
//   SPLIT  work-items that share one ray, each a part of the slices: 1, 2 or 4; more than 1 only with LANES 1
//   VOXELS_16  whether levels may have voxels of 16 bits behind their words (opencl_volume.h): 1 on a CPU
// A tile of the image is one work-group's. All loop bounds come from the plan, so they are uniform in a group.
#define ITEMS (RAYS / LANES)
#define GROUP (ITEMS * SPLIT)

// Calls would keep the loops over rays from becoming vector code.
#define INLINE static inline __attribute__((always_inline))

// A level's box of voxels; DeviceGrid on the host.
typedef struct {
  int size_x, size_y, size_z;          // padded voxels
  int bricks_x, bricks_y, bricks_z;    // occupancy grid
  float centre_x, centre_y, centre_z;  // box centre, padded index
  int has_voxels;                      // whether 16-bit voxels stand behind the words
} Grid;

INLINE float linear(__global const float* m, float u, float v) { return fma(m[0], u, fma(m[1], v, m[2])); }

INLINE int component_i(int3 v, int axis) { return axis == 0 ? v.x : (axis == 1 ? v.y : v.z); }
INLINE float component_f(float3 v, int axis) { return axis == 0 ? v.x : (axis == 1 ? v.y : v.z); }

// Tile's image origin. Tiles run row by row.
INLINE int2 tile_origin(int tile, int tiles_x) { return (int2)((tile % tiles_x) * TILE, (tile / tiles_x) * TILE); }

// A direction component that is safe to divide by; without a branch, so that loops over rays stay vector code.
INLINE float away_from_zero(float d) { return copysign(fmax(fabs(d), 1e-7f), d); }

// A voxel is the low half of its word, its neighbour in z the high half.
#define LOW(word) ((float)(int)((word) & 0xffffu))
#define HIGH(word) ((float)(int)((word) >> 16))

#pragma once

#include <string>

#include "xray_registration/drr/ray_motion.h"
#include "xray_registration/drr/tile_shape.h"

/// What the fast method's kernels and their host agree on: sizes, and where things stand in buffers. The host uses
/// these constants, the kernels get them by -D (layoutOptions); a kernel whose constant is missing does not compile.
namespace xray_registration::layout {

// Tiles of the image: a work-group renders one.
constexpr int kTile = kTilePixels;
constexpr int kRays = kTile * kTile;  ///< Of a tile. Also the items of the groups that do not march.

// The CT on the device.
constexpr int kBrick = 8;    ///< Voxels along the side of a cell of the occupancy grid.
constexpr int kPadding = 2;  ///< Layers of air around the box, so that a clamped sample lies between two air voxels.

// One pose's parameters, floats (opencl/pose_parameters.h writes them).
constexpr int kPoseStride = 64;
constexpr int kPoseDirection = 0;          ///< 3 × 3: ray direction in voxels, linear in (u, v, 1).
constexpr int kPoseCross = 9;              ///< 3 × 3: source × direction, linear in (u, v, 1).
constexpr int kPoseRotation = 18;          ///< 3 × 3: camera mm → voxels.
constexpr int kPoseSource = 27;            ///< 3: source relative to the box centre, voxels.
constexpr int kPoseSourceDerivative = 30;  ///< 6 × 3: of the source by each component of the twist.
constexpr int kPoseScale = 48;             ///< Voxel value → 1/mm.
constexpr int kPoseInverseFx = 49;
constexpr int kPoseInverseFy = 50;
constexpr int kPoseCx = 51;  ///< Principal point relative to the image's middle, pixels.
constexpr int kPoseCy = 52;
constexpr int kPoseMiddleU = 53;  ///< The image's middle, pixels.
constexpr int kPoseMiddleV = 54;

// A tile's sums, floats: the weighted products of all pairs of its vectors, upper triangle row by row, then the two
// values that DRR and X-ray are relative to.
constexpr int kVectors = 9;  ///< 1, DRR, X-ray, the DRR's six derivatives.
constexpr int kSums = kVectors * (kVectors + 1) / 2;
constexpr int kSumStride = 48;

// What the windows of one group add up to, floats.
constexpr int kTerms = 56;
constexpr int kTermMatrix = 0;     ///< 21: upper triangle of the Gauss-Newton matrix.
constexpr int kTermGradient = 21;  ///< 6.
constexpr int kTermCost = 27;
constexpr int kTermWeight = 28;
constexpr int kTermSimilarity = 29;  ///< Content · correlation.
constexpr int kTermInliers = 30;     ///< Content of windows that correlate.
constexpr int kTermContent = 31;
constexpr int kTermScatter = 32;  ///< 21: upper triangle of the sum of the gradients' outer products.
constexpr int kTermsUsed = 53;

constexpr float kInlierCorrelation = 0.4F;  ///< A window that correlates better shows the CT.
constexpr float kLeftOut = -2.0F;           ///< "Correlation" of a window that does not count.

// A motion of the rays (ray_motion.h), floats.
constexpr int kMostMotions = kMostRayMotions;
constexpr int kMotionStride = 16;
constexpr int kMotionSource = 0;     ///< 3
constexpr int kMotionDirection = 3;  ///< 3 × 3, row by row
constexpr int kMotionRadial = 12;
constexpr int kMotionSwirl = 13;
constexpr int kMotionOfCamera = 14;  ///< 1 or 0

constexpr int kShiftsAtOnce = 32;  ///< Of a DRR against an X-ray, by one work-item of a CPU.

constexpr int kMapStep = 4;  ///< Pixels between the points of the map of unexplained tissue.

/// Tiles along so many pixels.
constexpr int tilesFor(int pixels) { return (pixels + kTile - 1) / kTile; }

/// -D for every constant above, under the kernels' names.
std::string layoutOptions();

}  // namespace xray_registration::layout

#include "xray_registration/drr/opencl/layout.h"

namespace xray_registration::layout {

static_assert(kRays == 64, "tile_sums.cl adds four vectors of 16 rays");
static_assert(kSums + 2 <= kSumStride && kTermsUsed <= kTerms && kTerms <= kRays, "windows.cl adds one term per item");

std::string layoutOptions() {
  struct Size {
    const char* name;
    int value;
  };
  static constexpr Size kSizes[] = {
      {"TILE", kTile},
      {"RAYS", kRays},
      {"BRICK", kBrick},
      {"PADDING", kPadding},
      {"POSE_STRIDE", kPoseStride},
      {"P_DIRECTION", kPoseDirection},
      {"P_CROSS", kPoseCross},
      {"P_ROTATION", kPoseRotation},
      {"P_SOURCE", kPoseSource},
      {"P_DSOURCE", kPoseSourceDerivative},
      {"P_SCALE", kPoseScale},
      {"P_INV_FX", kPoseInverseFx},
      {"P_INV_FY", kPoseInverseFy},
      {"P_CX", kPoseCx},
      {"P_CY", kPoseCy},
      {"P_MID_U", kPoseMiddleU},
      {"P_MID_V", kPoseMiddleV},
      {"VECTORS", kVectors},
      {"SUMS", kSums},
      {"SUM_STRIDE", kSumStride},
      {"SHIFTS_AT_ONCE", kShiftsAtOnce},
      {"TERMS", kTerms},
      {"T_MATRIX", kTermMatrix},
      {"T_GRADIENT", kTermGradient},
      {"T_COST", kTermCost},
      {"T_WEIGHT", kTermWeight},
      {"T_SIMILARITY", kTermSimilarity},
      {"T_INLIERS", kTermInliers},
      {"T_CONTENT", kTermContent},
      {"T_SCATTER", kTermScatter},
      {"TERMS_USED", kTermsUsed},
      {"MOST_MOTIONS", kMostMotions},
      {"MOTION_STRIDE", kMotionStride},
      {"M_SOURCE", kMotionSource},
      {"M_DIRECTION", kMotionDirection},
      {"M_RADIAL", kMotionRadial},
      {"M_SWIRL", kMotionSwirl},
      {"M_OF_CAMERA", kMotionOfCamera},
      {"MAP_STEP", kMapStep},
  };
  std::string options;
  for (const Size& size : kSizes) options += std::string(" -D") + size.name + "=" + std::to_string(size.value);
  options += " -DINLIER_CORRELATION=" + std::to_string(kInlierCorrelation) + "f";
  options += " -DLEFT_OUT=" + std::to_string(kLeftOut) + "f";
  return options;
}

}  // namespace xray_registration::layout

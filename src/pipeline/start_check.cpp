#include "xray_registration/pipeline/start_check.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>

namespace xray_registration {
namespace {

constexpr double kSpeckPx = 4.0;            // A shadow that is smaller shows nothing.
constexpr double kMetresLookLikeMm = 10.0;  // No source stands so near to the origin of a CT that it looks at.

/// Where a box lies in an image, pixels.
struct Shadow {
  Eigen::Array2d least = Eigen::Array2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array2d most = -least;
  int behind = 0;  ///< Corners that are not in front of the source.
};

Shadow shadowOf(const RigidTransform& T_camera_ct, const std::array<Eigen::Vector3d, 8>& corners_ct_mm,
                const XrayCamera& camera) {
  Shadow shadow;
  for (const Eigen::Vector3d& corner : corners_ct_mm) {
    const Eigen::Vector3d point = T_camera_ct * corner;
    if (point.z() <= 0.0) {
      ++shadow.behind;
      continue;
    }
    const Eigen::Array2d pixel = camera.project(point).array();
    shadow.least = shadow.least.min(pixel);
    shadow.most = shadow.most.max(pixel);
  }
  return shadow;
}

std::string metres(double mm) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g m", mm * 1e-3);
  return text;
}

/// What is wrong with where the CT would be; empty when nothing is.
std::string problemOf(const RigidTransform& T_camera_ct, const VolumeGrid& box, const XrayCamera& camera) {
  const Eigen::Vector3d centre = T_camera_ct * box.centreCt();
  const Shadow shadow = shadowOf(T_camera_ct, box.cornersCt(), camera);
  if (shadow.behind == 8) return "behind the X-ray source, at z = " + metres(centre.z());
  if (T_camera_ct.translation().norm() < kMetresLookLikeMm && shadow.behind > 0) return "around the X-ray source";
  if (shadow.behind > 0) return "";  // Its shadow has no end.
  if ((shadow.most - shadow.least).maxCoeff() < kSpeckPx) {
    return "so far away, at z = " + metres(centre.z()) + ", that it would be a speck in the image";
  }
  const Eigen::Array2d end(camera.width, camera.height);
  if ((shadow.most < 0.0).any() || (shadow.least > end - 1.0).any()) {
    const Eigen::Vector2d pixel = camera.project(centre);
    char text[128];
    std::snprintf(text, sizeof text, "beside the image: its middle would be at column %.0f, row %.0f of %d x %d",
                  pixel.x(), pixel.y(), camera.width, camera.height);
    return text;
  }
  return "";
}

/// A start with its lengths in another unit.
RigidTransform scaled(RigidTransform T_camera_ct, double factor) {
  T_camera_ct.translation() *= factor;
  return T_camera_ct;
}

}  // namespace

std::string impossibleStart(const RigidTransform& T_camera_ct, const VolumeGrid& box, const XrayCamera& camera) {
  const std::string problem = problemOf(T_camera_ct, box, camera);
  if (problem.empty()) return "";
  std::string remedy =
      "poses are those of the CT's frame in the X-ray's optical frame (z towards the detector), in metres";
  if (problemOf(scaled(T_camera_ct, 1e-3), box, camera).empty()) remedy = "are these millimetres where metres are due?";
  if (problemOf(scaled(T_camera_ct, 1e3), box, camera).empty()) remedy = "are these metres where millimetres are due?";
  return "the start is wrong: it has the CT " + problem + "; " + remedy;
}

}  // namespace xray_registration

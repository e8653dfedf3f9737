#include "xray_registration/image/landmark_place.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "image/landmarks/landmark_checks.h"

namespace xray_registration {
namespace {

constexpr double kMargin_mm = 10.0;

bool isIn(const Eigen::Vector3d& point, const VolumeGrid& grid) {
  const Eigen::Vector3d index = grid.ctFromIndex().inverse() * point;
  const Eigen::Array3d margin = kMargin_mm / grid.spacing_mm.array();
  return (index.array() > -0.5 - margin).all() &&
         (index.array() < grid.size.cast<double>().array() - 0.5 + margin).all();
}

}  // namespace

std::string outsideOfCt(const std::vector<Landmark>& landmarks, const VolumeGrid& grid) {
  const auto all_fit = [&](const Eigen::Vector3d& factors) {
    return std::all_of(landmarks.begin(), landmarks.end(),
                       [&](const Landmark& landmark) { return isIn(landmark.point_ct.cwiseProduct(factors), grid); });
  };
  const auto outside = std::find_if(landmarks.begin(), landmarks.end(), [&](const Landmark& landmark) {
    return landmark.point_ct.allFinite() && !isIn(landmark.point_ct, grid);
  });
  if (outside == landmarks.end()) return "";
  const std::string problem =
      nameOf(landmarks, static_cast<std::size_t>(outside - landmarks.begin())) + " lies outside of the CT; ";
  if (all_fit({-1.0, -1.0, 1.0})) return problem + "all would lie in it if they were RAS, but they are taken to be LPS";
  if (all_fit(Eigen::Vector3d::Constant(1e-3))) {
    return problem + "all would lie in it if they were a thousand times smaller: were they given in mm for metres?";
  }
  return problem + "points are in the CT's coordinates, LPS";
}

}  // namespace xray_registration

#include "xray_registration/pipeline/calibration_frames.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace xray_registration {
namespace {

/// At which a turn counts as much as a shift, mm.
constexpr double kArmMm = 60.0;

double distance(const RigidTransform& a, const RigidTransform& b, const Eigen::Vector3d& centre_ct_mm) {
  const Twist twist = twistBetween(a, b, a * centre_ct_mm);
  return std::hypot(twist.head<3>().norm(), kArmMm * twist.tail<3>().norm());
}

std::vector<std::string> namesOf(const std::vector<RawView>& views) {
  std::vector<std::string> names;
  names.reserve(views.size());
  for (const RawView& view : views) names.push_back(view.name);
  return names;
}

}  // namespace

std::vector<std::size_t> mostDifferent(const std::vector<RigidTransform>& T_camera_ct,
                                       const Eigen::Vector3d& centre_ct_mm, std::size_t most) {
  std::vector<std::size_t> chosen;
  std::vector<double> nearest(T_camera_ct.size(), std::numeric_limits<double>::max());
  for (std::size_t next = 0; chosen.size() < std::min(most, T_camera_ct.size());) {
    chosen.push_back(next);
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      nearest[i] = std::min(nearest[i], distance(T_camera_ct[next], T_camera_ct[i], centre_ct_mm));
    }
    nearest[next] = -1.0;
    next = static_cast<std::size_t>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

void CalibrationFrames::add(Views views, const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm) {
  if (most_ == 0) return;
  // The newest is the first of those that are chosen from: a geometry that has changed since must not be what is kept.
  views_.insert(views_.begin(), std::move(views));
  T_camera_ct_.insert(T_camera_ct_.begin(), T_camera_ct);
  if (views_.size() <= most_) return;
  std::vector<Views> kept;
  std::vector<RigidTransform> poses;
  for (const std::size_t i : mostDifferent(T_camera_ct_, centre_ct_mm, most_)) {
    kept.push_back(std::move(views_[i]));
    poses.push_back(T_camera_ct_[i]);
  }
  views_ = std::move(kept);
  T_camera_ct_ = std::move(poses);
}

void CalibrationFrames::forget() {
  views_.clear();
  T_camera_ct_.clear();
}

GeometryCalibration CalibrationFrames::calibrate(Engine* engine, const ImageParameters& image,
                                                 const std::function<void()>& progress) const {
  if (views_.empty()) throw std::invalid_argument("no frame was registered that could be calibrated with");
  const std::vector<RawView> first = told();
  FrameMaker maker(image, namesOf(first));
  const auto made = [&](std::size_t frame, const std::vector<ViewGeometry>& geometry) {
    return correctedViews(views_[frame](), geometry, &maker);
  };
  return calibrateGeometry(engine, made, T_camera_ct_, toldGeometry(first), {}, progress);
}

}  // namespace xray_registration

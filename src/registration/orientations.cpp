#include "registration/orientations.h"

#include <cmath>

namespace xray_registration {
namespace {

constexpr double kPi = 3.14159265358979323846;

bool isUsual(const Eigen::Matrix3d& R_camera_ct) {
  constexpr double kOutOfAxialPlane = 0.643;  // sin 40°
  const Eigen::Vector3d head = R_camera_ct.col(2);
  const double across = head.head<2>().norm();
  return std::abs(head.z()) <= kOutOfAxialPlane && std::abs(head.y()) >= std::sqrt(0.5) * across;
}

/// Looks along `angle` in the axial plane, from the front (0) by the patient's left side; the head up in the image.
Eigen::Matrix3d standardView(double angle, bool head_up) {
  const Eigen::Vector3d forward(std::sin(angle), std::cos(angle), 0.0);  // LPS: from the front is +y.
  const Eigen::Vector3d down(0.0, 0.0, head_up ? -1.0 : 1.0);
  Eigen::Matrix3d R_camera_ct;
  R_camera_ct.row(0) = down.cross(forward);
  R_camera_ct.row(1) = down;
  R_camera_ct.row(2) = forward;
  return R_camera_ct;
}

}  // namespace

std::vector<Eigen::Matrix3d> evenRotations(double spacing_rad) {
  // All rotations have the volume 8π² in units of the angle's cube.
  const int count = static_cast<int>(std::ceil(8.0 * kPi * kPi / (spacing_rad * spacing_rad * spacing_rad)));
  const double phi = std::sqrt(2.0);
  constexpr double kPsi = 1.533751168755204288118041;  // ψ⁴ = ψ + 4
  std::vector<Eigen::Matrix3d> rotations;
  rotations.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double s = i + 0.5;
    const double t = s / count;
    const double alpha = 2.0 * kPi * s / phi;
    const double beta = 2.0 * kPi * s / kPsi;
    const double near = std::sqrt(t);
    const double far = std::sqrt(1.0 - t);
    rotations.push_back(
        Eigen::Quaterniond(far * std::cos(beta), near * std::sin(alpha), near * std::cos(alpha), far * std::sin(beta))
            .toRotationMatrix());
  }
  return rotations;
}

std::vector<Eigen::Matrix3d> orientationsAround(const Eigen::Matrix3d& R_camera_ct, double rotation_rad,
                                                double spacing_rad) {
  std::vector<Eigen::Matrix3d> orientations = {R_camera_ct};
  for (const Eigen::Matrix3d& rotation : evenRotations(spacing_rad)) {
    // What lies a little beyond may be the nearest to something at the border.
    if (Eigen::AngleAxisd(rotation).angle() <= rotation_rad + 0.25 * spacing_rad) {
      orientations.emplace_back(rotation * R_camera_ct);
    }
  }
  return orientations;
}

std::vector<Eigen::Matrix3d> usualOrientations(double spacing_rad) {
  std::vector<Eigen::Matrix3d> orientations;
  for (const bool head_up : {true, false}) {
    for (int eighth = 0; eighth < 8; ++eighth) orientations.push_back(standardView(eighth * kPi / 4.0, head_up));
  }
  for (const Eigen::Matrix3d& rotation : evenRotations(spacing_rad)) {
    if (isUsual(rotation)) orientations.push_back(rotation);
  }
  return orientations;
}

}  // namespace xray_registration

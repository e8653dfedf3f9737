#include "tools/common/session_generator.h"

#include <cmath>
#include <random>

#include "tools/common/command_line.h"

namespace xray_registration::tools {
namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

void requireRange(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw ArgumentError(std::string(name) + " is " + std::to_string(value) + ": allowed are " + std::to_string(low) +
                      " to " + std::to_string(high));
}

XrayCamera cameraOf(const SessionSetup& setup) {
  XrayCamera camera;
  camera.width = setup.image_size;
  camera.height = setup.image_size;
  camera.fx = setup.source_detector_mm * setup.image_size / setup.detector_mm;
  camera.fy = camera.fx;
  camera.cx = 0.5 * (setup.image_size - 1);
  camera.cy = camera.cx;
  return camera;
}

/// Optical axes of a camera that looks at the centre, in LPS: at 0° x is the patient's left, y is down the patient,
/// z runs from the chest to the back.
RigidTransform poseAtRest(const ViewSetup& view, double source_centre_mm, const Eigen::Vector3d& centre_ct_mm) {
  const double angle = view.angle_deg * kRadPerDeg;
  RigidTransform T_camera_ct = RigidTransform::Identity();
  Eigen::Matrix3d R_camera_ct;
  R_camera_ct.row(0) << std::cos(angle), std::sin(angle), 0.0;
  R_camera_ct.row(1) << 0.0, 0.0, -1.0;
  R_camera_ct.row(2) << -std::sin(angle), std::cos(angle), 0.0;
  T_camera_ct.linear() = R_camera_ct;
  T_camera_ct.translation() = Eigen::Vector3d(0.0, 0.0, source_centre_mm) - R_camera_ct * centre_ct_mm;
  return T_camera_ct;
}

/// A rod that comes in from the image's upper right corner and a ball in its lower left, above the patient.
std::vector<Instrument> rodAndBall(double source_centre_mm, double half_width_mm) {
  const double depth = 0.8 * source_centre_mm;
  const double reach = 0.8 * half_width_mm;
  Instrument rod;
  rod.a_camera_mm = {1.4 * reach, -1.4 * reach, depth};
  rod.b_camera_mm = {0.1 * reach, -0.1 * reach, depth + 20.0};
  rod.radius_mm = 2.5;
  Instrument ball;
  ball.a_camera_mm = {-0.5 * reach, 0.45 * reach, depth};
  ball.b_camera_mm = ball.a_camera_mm;
  ball.radius_mm = 5.0;
  return {rod, ball};
}

}  // namespace

std::vector<ViewSetup> parseViews(const std::string& text) {
  std::vector<ViewSetup> views;
  for (const auto& part : splitList(text)) {
    const auto colon = part.find(':');
    if (colon == std::string::npos || colon == 0) {
      throw ArgumentError("view '" + part + "': expected NAME:DEGREES, as ap:0 or lateral:90");
    }
    const ViewSetup view{part.substr(0, colon), parseNumber(part.substr(colon + 1), "angle of view '" + part + "'")};
    for (const auto& other : views) {
      if (other.name == view.name) throw ArgumentError("view '" + view.name + "' is named twice");
    }
    views.push_back(view);
  }
  if (views.empty()) throw ArgumentError("no view is named: expected NAME:DEGREES, as ap:0");
  return views;
}

void SessionSetup::check() const {
  if (views.empty()) throw ArgumentError("a session needs a view");
  requireRange("image size", image_size, 16, 4096);
  requireRange("detector side (mm)", detector_mm, 10.0, 2000.0);
  requireRange("distance source to detector (mm)", source_detector_mm, 100.0, 10000.0);
  requireRange("distance source to centre (mm)", source_centre_mm, 50.0, source_detector_mm);
  requireRange("amplitude (mm)", amplitude_mm, 0.0, 500.0);
  requireRange("amplitude (degrees)", amplitude_deg, 0.0, 90.0);
  requireRange("period of the motion (s)", period_s, 0.1, 3600.0);
  requireRange("photons per pixel", physics.photons_per_pixel, 0.0, 1e7);
  requireRange("readout noise (counts)", physics.readout_noise, 0.0, 10000.0);
  requireRange("scatter fraction", physics.scatter_fraction, 0.0, 10.0);
  requireRange("gain (counts per photon)", physics.gain, 1e-3, 1e4);
  requireRange("collimator radius (px)", physics.collimator_radius_px, 0.0, 10000.0);
  bodies.check();
}

SessionGenerator::SessionGenerator(const Volume& ct, SessionSetup setup, const LabelVolume& labels)
    : setup_((setup.check(), std::move(setup))),
      volume_(toAttenuation(ct, setup_.attenuation)),
      camera_(cameraOf(setup_)),
      centre_ct_mm_(anatomicalCentreCt(volume_)),
      trajectory_(setup_.amplitude_mm, setup_.amplitude_deg, setup_.period_s, setup_.seed) {
  for (const auto& view : setup_.views) {
    T_view_ct_at_rest_.push_back(poseAtRest(view, setup_.source_centre_mm, centre_ct_mm_));
  }
  if (!setup_.bodies.bodies.empty()) {
    bodies_.emplace(ct, setup_.attenuation, labels, setup_.bodies, setup_.period_s, setup_.seed);
  }
  if (setup_.instrument) {
    const double half_width_mm = 0.5 * setup_.detector_mm * setup_.source_centre_mm / setup_.source_detector_mm;
    setup_.physics.instruments = rodAndBall(setup_.source_centre_mm, half_width_mm);
  }
}

RigidTransform SessionGenerator::viewFromFirst(std::size_t view) const {
  return T_view_ct_at_rest_.at(view) * T_view_ct_at_rest_.front().inverse();
}

RigidTransform SessionGenerator::cameraFromCt(std::size_t view, double time_s) const {
  return T_view_ct_at_rest_.at(view) * trajectory_.motionCt(time_s, centre_ct_mm_);
}

RigidTransform SessionGenerator::cameraFromBody(std::size_t view, std::size_t body, double time_s) const {
  return cameraFromCt(view, time_s) * bodies_->motionCt(body, time_s);
}

std::vector<PosedVolume> SessionGenerator::partsAt(std::size_t view, double time_s) const {
  const RigidTransform T_camera_ct = cameraFromCt(view, time_s);
  if (!bodies_) return {{&volume_, T_camera_ct}};
  std::vector<PosedVolume> parts = {{&bodies_->parts().rest, T_camera_ct}};
  for (std::size_t i = 0; i < bodies_->parts().bodies.size(); ++i) {
    parts.push_back({&bodies_->parts().bodies[i], cameraFromBody(view, i, time_s)});
  }
  return parts;
}

Image<std::uint16_t> SessionGenerator::xray(std::size_t view, std::size_t frame, double time_s) const {
  // Any two images get generators that are far apart.
  std::seed_seq seeds{static_cast<std::uint32_t>(setup_.seed), static_cast<std::uint32_t>(setup_.seed >> 32U),
                      static_cast<std::uint32_t>(frame), static_cast<std::uint32_t>(view)};
  std::mt19937_64 random(seeds);
  return simulateXray(partsAt(view, time_s), camera_, setup_.physics, &random);
}

}  // namespace xray_registration::tools

#include "tools/common/trajectory.h"

#include <cmath>
#include <random>
#include <stdexcept>

namespace xray_registration::tools {
namespace {

constexpr double kPi = 3.14159265358979323846;

}  // namespace

Trajectory::Trajectory(double amplitude_mm, double amplitude_deg, double period_s, std::uint64_t seed)
    : period_s_(period_s) {
  if (!(amplitude_mm >= 0.0) || !(amplitude_deg >= 0.0)) {
    throw std::invalid_argument("the amplitude of a motion must not be below zero");
  }
  if (!(period_s > 0.0)) throw std::invalid_argument("the period of a motion must be above zero");
  // The generator's raw bits are fixed by the standard; its distributions are not.
  std::mt19937_64 random(seed);
  const auto phase = [&random] { return 2.0 * kPi * static_cast<double>(random() >> 11) * 0x1p-53; };
  for (std::size_t i = 0; i < components_.size(); ++i) {
    const double amplitude = i < 3 ? amplitude_mm : amplitude_deg * kPi / 180.0;
    components_[i] = {Sine{0.6 * amplitude, 1.0, phase()}, Sine{0.3 * amplitude, 2.0, phase()},
                      Sine{0.1 * amplitude, 3.0, phase()}};
  }
}

RigidTransform Trajectory::motionCt(double time_s, const Eigen::Vector3d& centre_ct_mm) const {
  Twist twist;
  for (std::size_t i = 0; i < components_.size(); ++i) {
    double value = 0.0;
    for (const Sine& sine : components_[i]) {
      value += sine.amplitude * std::sin(2.0 * kPi * sine.turns * time_s / period_s_ + sine.phase_rad);
    }
    twist[static_cast<Eigen::Index>(i)] = value;
  }
  return updatedPose(RigidTransform::Identity(), twist, centre_ct_mm);
}

}  // namespace xray_registration::tools

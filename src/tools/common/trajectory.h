#pragma once

#include <array>
#include <cstdint>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration::tools {

/// A patient who moves smoothly: each of the six components is a sum of three sines whose amplitudes add up to the
/// given one, with phases from the seed. Repeats itself after `period_s`, so that a recording can be played in a loop.
class Trajectory {
 public:
  /// @throws std::invalid_argument for an amplitude below zero or a period that is not above zero.
  Trajectory(double amplitude_mm, double amplitude_deg, double period_s, std::uint64_t seed);

  /// Motion about `centre_ct_mm` in the axes of the CT: maps points of the CT at rest to where they are at `time_s`.
  RigidTransform motionCt(double time_s, const Eigen::Vector3d& centre_ct_mm) const;

 private:
  struct Sine {
    double amplitude;
    double turns;  ///< Per period.
    double phase_rad;
  };
  std::array<std::array<Sine, 3>, 6> components_{};
  double period_s_;
};

}  // namespace xray_registration::tools

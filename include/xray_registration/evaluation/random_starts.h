#pragma once

#include <cstdint>
#include <random>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// How far random starts lie from the truth.
struct StartRange {
  double rotation_rad = 0.0;    ///< The angle is uniform in ±rotation, its axis uniform on the sphere.
  double translation_mm = 0.0;  ///< Each component is uniform in ±translation, camera axes.
};

/// Random disturbances of a pose, about the CT's centre in camera axes. Made from the bits of std::mt19937_64 with
/// arithmetic of its own, because the standard's distributions differ between libraries: the same seed gives the same
/// starts everywhere.
class RandomStarts {
 public:
  RandomStarts(const StartRange& range, std::uint64_t seed) : range_(range), bits_(seed) {}

  /// The next disturbance, for updatedPose.
  Twist next();

 private:
  double uniform(double low, double high);
  Eigen::Vector3d unitVector();

  StartRange range_;
  std::mt19937_64 bits_;
};

}  // namespace xray_registration

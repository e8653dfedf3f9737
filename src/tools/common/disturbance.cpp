#include "tools/common/disturbance.h"

#include "tools/common/command_line.h"
#include "xray_registration/evaluation/random_starts.h"

namespace xray_registration::tools {

RigidTransform disturbedPose(const RigidTransform& T_camera_ct, const std::string& degrees_mm, std::uint64_t seed,
                             const Eigen::Vector3d& centre_ct_mm) {
  if (degrees_mm.empty()) return T_camera_ct;
  const auto [degrees, mm] = parsePair(degrees_mm, "--disturb");
  if (degrees < 0.0 || degrees > 180.0 || mm < 0.0) {
    throw ArgumentError("--disturb " + degrees_mm + ": allowed are 0 to 180 degrees and no less than 0 mm");
  }
  constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;
  Twist twist = RandomStarts({1.0, 1.0}, seed).next();
  twist.head<3>() = mm * twist.head<3>().normalized();
  twist.tail<3>() = degrees * kRadPerDeg * twist.tail<3>().normalized();
  return updatedPose(T_camera_ct, twist, T_camera_ct * centre_ct_mm);
}

}  // namespace xray_registration::tools

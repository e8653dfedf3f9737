#pragma once

#include <memory>
#include <optional>
#include <string>

#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/tracker.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// One body that is followed from frame to frame: what it looks like, and where it was last seen.
struct RegisteredBody {
  explicit RegisteredBody(const TrackerOptions& options) : tracker(options) {}

  /// A start in the first view's camera frame; replaces all history. The next frame is a cold start.
  void startFrom(const RigidTransform& T_camera_ct);
  /// No pose is known any more. The CT stays.
  void forgetPose();

  std::string name;                                      ///< Of its CT.
  std::shared_ptr<const AttenuationVolume> attenuation;  ///< Null: there is no CT yet. Kept for a device opened anew.
  std::unique_ptr<Registrar> registrar;                  ///< Null, or with the CT on the device (DeviceHost::upload).
  Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();
  Tracker tracker;
  std::optional<double> last_accepted_s;  ///< Stamp of the last accepted frame since the pose was set.
};

}  // namespace xray_registration

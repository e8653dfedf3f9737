#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/tracker.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// How far around its start a body is searched for.
struct BodyRange {
  double rotation_rad = 0.0;
  double translation_mm = 0.0;
  double saturation = 0.0;  ///< RegistrarOptions::saturation; of metal.
};

/// One CT that is followed from frame to frame, with the bodies that move in it: what it looks like, and where it was
/// last seen.
struct RegisteredBody {
  explicit RegisteredBody(const TrackerOptions& options) : tracker(options) {}

  /// What its registrar goes by: a body with a CT of its own has ranges of its own.
  RegistrarOptions optionsFrom(RegistrarOptions options) const;

  /// A start in the first view's camera frame; replaces all history. The next frame is a cold start.
  void startFrom(const RigidTransform& T_camera_ct, const std::vector<RigidTransform>& T_ct_bodies = {});
  /// No pose is known any more. The CT stays.
  void forgetPose();

  std::string name;                                      ///< Of its CT.
  std::shared_ptr<const AttenuationVolume> attenuation;  ///< Null: there is no CT yet. Kept for a device opened anew.
  std::shared_ptr<const AttenuationVolume> rest;         ///< The CT without `bodies`; null without any.
  std::vector<BodyModel> bodies;                         ///< Cut out of the CT, each with a pose of its own.
  std::optional<BodyRange> range;                        ///< Of a body with a CT or a mesh of its own.
  std::optional<RigidTransform> T_camera_ct_configured;  ///< Where such a body starts, whatever the CT's start is.
  std::unique_ptr<Registrar> registrar;                  ///< Null, or with the CT on the device (DeviceHost::upload).
  Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();
  Tracker tracker;
  std::optional<double> last_accepted_s;  ///< Stamp of the last accepted frame since the pose was set.
};

}  // namespace xray_registration

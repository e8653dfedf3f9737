#pragma once

#include <utility>
#include <vector>

#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// What a tracker is given instead of the registrar itself.
///
/// Lets a frame go on without its first view: the registrar sees the first view that is there as the first, the caller
/// keeps the pose in the camera frame of the first one of all.
///
/// Registrars promise finite poses; a broken promise is a refused frame and reaches neither the tracker nor tf.
class CheckedRegistrar : public Registrar {
 public:
  explicit CheckedRegistrar(Registrar* registrar) : registrar_(registrar) {}
  /// The frame is registered among these places (Registrar::registerAmong), in the caller's camera frame, instead of
  /// from the start that it is given.
  CheckedRegistrar(Registrar* registrar, std::vector<RigidTransform> T_first_ct_places)
      : registrar_(registrar), T_first_ct_places_(std::move(T_first_ct_places)) {}

  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& T_first_ct_start,
                                   bool tracking) override;

  std::vector<BodyResult> registerBodies(const std::vector<BodyStart>& starts, RegistrationResult* rest) override;

  void setVolume(const AttenuationVolume& volume) override { registrar_->setVolume(volume); }
  void setBodies(const AttenuationVolume& rest, const std::vector<BodyModel>& bodies) override {
    registrar_->setBodies(rest, bodies);
  }
  bool hasVolume() const override { return registrar_->hasVolume(); }
  void forget() override { registrar_->forget(); }
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) override {
    return registrar_->renderDrr(camera, T_camera_ct);
  }
  Eigen::Vector3d centreCt() const override { return registrar_->centreCt(); }
  bool setOptions(const RegistrarOptions& options) override { return registrar_->setOptions(options); }
  std::string deviceName() const override { return registrar_->deviceName(); }
  std::size_t deviceBytes() const override { return registrar_->deviceBytes(); }

 private:
  RegistrationResult registerBased(const std::vector<ViewInput>& views, const RigidTransform& T_base_first,
                                   const RigidTransform& T_first_ct_start, bool tracking);
  RegistrationResult inCallersFrame(RegistrationResult result) const;

  Registrar* registrar_;
  std::vector<RigidTransform> T_first_ct_places_;
  RigidTransform T_first_base_ =
      RigidTransform::Identity();  ///< Of the last frame: base is the registrar's first view.
};

}  // namespace xray_registration

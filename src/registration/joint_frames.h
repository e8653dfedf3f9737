#pragma once

#include <memory>
#include <vector>

#include "registration/setup_objective.h"
#include "xray_registration/registration/geometry_calibration.h"

namespace xray_registration {

/// A hypothesis about what all frames of a calibration have in common, and where the CT was in each.
struct JointSetup {
  std::vector<ViewGeometry> views;
  std::vector<RigidTransform> T_camera_ct;  ///< One for each frame.
};

/// The frames of a calibration, all of them on the device. Distortion is undone in the images, which are made anew when
/// a hypothesis has another one. @throws DeviceError from every call.
class JointFrames {
 public:
  /// All must outlive it.
  JointFrames(Engine* engine, const MakeCalibrationViews& make_views, const std::function<void()>& progress)
      : engine_(engine), make_views_(make_views), progress_(progress) {}

  /// Makes all images for a hypothesis, cropped and weighed as seen from there.
  void make(const JointSetup& setup);
  /// Whether rays that the CT cannot explain are left out.
  void leaveOutUnexplained(bool leave_out) { leave_out_ = leave_out; }

  /// One evidence for each frame, in the layout of SetupObjective. `robust_scales2`: one for each frame.
  std::vector<SetupEvidence> evaluate(const JointSetup& setup, const Stage& stage,
                                      const std::vector<double>& robust_scales2);

  /// After make() for the same hypothesis.
  std::vector<ResidualMotion> residualMotion(const JointSetup& setup);

  std::size_t size() const { return frames_.size(); }
  int lastLevel() const;
  /// The finest one whose pixels, at the CT, are about half a voxel or larger in every view.
  int levelOfCt(const JointSetup& setup) const;
  Eigen::Vector3d centreCt() const { return engine_->volume().centreCt(); }
  /// Of the image as it came.
  const XrayCamera& camera(std::size_t view) const { return frames_.front()->views()[view].told; }

 private:
  Setup setupOf(const JointSetup& setup, std::size_t frame) const;
  bool sameDistortion(const JointSetup& setup) const;
  void addResidualMotion(const JointSetup& setup, std::size_t frame, std::size_t view,
                         std::vector<ResidualMotion>* all);

  Engine* engine_;
  const MakeCalibrationViews& make_views_;
  const std::function<void()>& progress_;
  bool leave_out_ = true;
  std::vector<ViewGeometry> made_for_;
  std::vector<std::unique_ptr<DeviceViews>> frames_;
};

}  // namespace xray_registration

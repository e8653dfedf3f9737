#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "xray_registration/drr/engine.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/registrar_options.h"

namespace xray_registration {

class DeviceViews;
class FrameObjective;
class MovingBodies;
class SetupCheck;
class StepBudget;
struct ColdStart;
struct Solution;

/// The fast method: coarse-to-fine Gauss-Newton on the chosen similarity (drr/similarities.def), any number of views in
/// one solve. See docs/design.md. Not thread-safe.
class FastRegistrar : public Registrar {
 public:
  /// Compiles the kernels. @throws DeviceError.
  FastRegistrar(std::shared_ptr<Device> device, const RegistrarOptions& options, const Logger& logger);
  ~FastRegistrar() override;

  void setVolume(const AttenuationVolume& volume) override;
  void setBodies(const AttenuationVolume& rest, const std::vector<BodyModel>& bodies) override;
  bool hasVolume() const override { return engine_->hasVolume(); }
  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start,
                                   bool tracking) override;
  RegistrationResult registerAmong(const std::vector<ViewInput>& views,
                                   const std::vector<RigidTransform>& T_camera_ct_starts) override;
  std::unique_ptr<WideSearch> searchWidely(const std::vector<ViewInput>& views, const WideSearchRange& range) override;
  std::vector<BodyResult> registerBodies(const std::vector<BodyStart>& starts, RegistrationResult* rest) override;
  void forget() override;
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) override;
  std::vector<FloatImage> renderParts(const XrayCamera& camera, const RigidTransform& T_camera_ct,
                                      const std::vector<RigidTransform>& T_camera_bodies) override;
  Eigen::Vector3d centreCt() const override { return engine_->volume().centreCt(); }
  /// Other tuning than thresholds makes the next frame a cold start.
  bool setOptions(const RegistrarOptions& options) override;
  std::string deviceName() const override { return device_->name(); }
  std::size_t deviceBytes() const override { return engine_->hasVolume() ? engine_->volume().bytes() : 0; }

  /// The engine, for the benchmark.
  Engine& engine() { return *engine_; }

 private:
  std::string problemOf(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start) const;
  RegistrationResult registerFrom(const std::vector<ViewInput>& inputs, const std::vector<RigidTransform>& starts,
                                  bool tracking);

  std::shared_ptr<Device> device_;
  RegistrarOptions options_;
  Logger logger_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<DeviceViews> views_;
  double reachMm(bool tracked) const;
  void spareLevels(FrameObjective* objective, const Solution& solution, bool searched);
  Solution track(const RigidTransform& T_camera_ct_start, StepBudget* budget);
  void checkSides(const std::vector<ViewInput>& inputs, const RigidTransform& T_camera_ct_start,
                  const Solution& solution, RegistrationResult* result);
  void checkSetup(const std::vector<ViewInput>& inputs, const Solution& solution, bool searched, StepBudget* budget,
                  RegistrationResult* result);

  std::unique_ptr<SetupCheck> setup_check_;
  int frames_until_check_ = 0;
  std::vector<SetupSuspicion> suspicions_;
  std::unique_ptr<MovingBodies> bodies_;  ///< Null: the CT is one.
  std::unique_ptr<Solution> solution_;    ///< Of the last frame.
  std::unique_ptr<ColdStart> found_;      ///< Empty: the next frame is a cold start.
};

}  // namespace xray_registration

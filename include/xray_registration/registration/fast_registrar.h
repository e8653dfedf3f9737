#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "xray_registration/drr/engine.h"
#include "xray_registration/registration/gauss_newton.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/registrar_options.h"

namespace xray_registration {

/// The fast method: coarse-to-fine Gauss-Newton on locally normalised correlation (or SSD with gain and offset
/// eliminated), any number of views in one solve. See docs/design.md. Not thread-safe.
class FastRegistrar : public Registrar {
 public:
  /// Compiles the kernels. @throws DeviceError.
  FastRegistrar(std::shared_ptr<Device> device, const RegistrarOptions& options, const Logger& logger);

  void setVolume(const AttenuationVolume& volume) override;
  bool hasVolume() const override { return engine_.hasVolume(); }
  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start,
                                   bool tracking) override;
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) override;
  Eigen::Vector3d centreCt() const override { return engine_.volume().centreCt(); }
  bool setOptions(const RegistrarOptions& options) override;
  std::string deviceName() const override { return device_->name(); }
  std::size_t deviceBytes() const override { return engine_.hasVolume() ? engine_.volume().bytes() : 0; }

  /// The engine, for the benchmark.
  Engine& engine() { return engine_; }

 private:
  /// One view on the device.
  struct View {
    ResidentXray xray;
    RigidTransform T_view_first;
    Matrix6d twist_carried;  ///< First camera's twist → this camera's.
    const ResidentXray::Level& level(int index) const { return xray.levels[static_cast<std::size_t>(index)]; }
  };
  /// One stage of the coarse-to-fine descent.
  struct Stage {
    int level = 0;  ///< X-ray pyramid level, 0 fine.
    int span = 2;
    int max_steps = 10;
  };

  /// A solution, and whether rays that the CT cannot explain were left out for it.
  struct Attempt {
    GaussNewtonResult solution;
    bool leave_out = false;
    bool noticed = false;  ///< Leaving them out changed weights.
  };

  int binningFor(const XrayCamera& whole, const RigidTransform& T_view_ct);
  /// A view on the device, cropped and binned.
  View uploadView(const ViewInput& view, const RigidTransform& T_camera_ct_start);
  /// Small windows where the pose is already close: they follow scatter and shading best.
  int finestSpan() const { return std::min(windowSpan(), 1); }
  int windowSpan() const { return options_.similarity == Similarity::kGainOffset ? 0 : 2; }
  /// The coarsest X-ray level on which the CT still has a shadow of some size.
  int coarsestLevel(const std::vector<View>& views, const RigidTransform& T_camera_ct);
  std::vector<Stage> stages(int coarsest) const;
  double depthOf(const RigidTransform& T_camera_ct) const;
  int volumeLevel(const XrayCamera& camera, const RigidTransform& T_view_ct) const;
  WindowOptions windowOptions(const View& view, const Stage& stage, double robust_scale2) const;
  StepSums evaluate(const std::vector<View>& views, const Stage& stage, double robust_scale2,
                    const RigidTransform& T_camera_ct);
  std::vector<StepSums> evaluateMany(const std::vector<View>& views, const Stage& stage, double robust_scale2,
                                     const std::vector<RigidTransform>& T_camera_ct);
  double robustScale(const std::vector<View>& views, const Stage& stage, const RigidTransform& T_camera_ct);
  /// Weights as seen from a pose; returns whether any view lost rays.
  bool weighViews(std::vector<View>* views, bool leave_out_unexplained, const RigidTransform& T_camera_ct);
  GaussNewtonOptions solverFor(const std::vector<View>& views, const Stage& stage, const RigidTransform& start) const;
  GaussNewtonResult solveStage(const std::vector<View>& views, const Stage& stage, double robust_scale2,
                               const RigidTransform& start, int steps_left);
  RigidTransform searchAround(const std::vector<View>& views, const Stage& stage, const RigidTransform& start,
                              int first_index, int* steps);
  GaussNewtonResult track(std::vector<View>* views, const RigidTransform& start, int* steps);
  GaussNewtonResult descend(std::vector<View>* views, const std::vector<Stage>& plan, bool leave_out,
                            const GaussNewtonResult& start, int* steps);
  Attempt attempt(std::vector<View>* views, int coarsest, bool leave_out, const RigidTransform& start, int first_index,
                  int* steps);
  Attempt searchAndDescend(std::vector<View>* views, int coarsest, const RigidTransform& start, int first_index,
                           int* steps);
  Attempt confirmedSearch(std::vector<View>* views, const RigidTransform& start, double* disagreement_mm, int* steps);
  void judge(const std::vector<View>& views, const GaussNewtonResult& solution, const RigidTransform& start,
             bool tracking, double disagreement_mm, RegistrationResult* result);

  std::shared_ptr<Device> device_;
  RegistrarOptions options_;
  Logger logger_;
  Engine engine_;
  // What the last cold start found, for the frames that are tracked from it.
  bool leave_out_unexplained_ = true;
  int coarsest_level_ = 0;
  double robust_scale2_ = 1e6;
};

}  // namespace xray_registration

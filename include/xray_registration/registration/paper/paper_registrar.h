#pragma once

#include <memory>

#include "xray_registration/drr/paper/paper_engine.h"
#include "xray_registration/registration/paper/paper_method.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/registrar_options.h"

namespace xray_registration {

/// The paper's method on X-rays: one view, one level, finite differences, samples weighted in mm.
///
/// Additions to the paper, without which no X-ray can be matched: gain and offset are eliminated in every step, and
/// a linear band-pass (PaperFilter) removes the smooth background (scatter) and the finest noise from X-ray and DRRs
/// alike. The CT is averaged to about paper_image_size voxels a side and the X-ray binned to at most paper_image_size
/// pixels a side: the paper's N is the volume's.
///
/// Rays that enter or leave the CT through tissue on a cut face at the start pose are masked (truncation_weights).
///
/// Several views are refused with a reason. The covariance is σ² N⁻¹ with the residual's σ and the correlation area of
/// the band-pass; it knows noise, not model errors. inlier_fraction is 1: nothing is weighted away.
class PaperRegistrar : public Registrar {
 public:
  /// @throws DeviceError when the kernels cannot be built.
  PaperRegistrar(std::shared_ptr<Device> device, const RegistrarOptions& options, Logger logger);

  void setVolume(const AttenuationVolume& volume) override;
  bool hasVolume() const override { return has_volume_; }
  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start,
                                   bool tracking) override;
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) override;
  Eigen::Vector3d centreCt() const override { return centre_ct_mm_; }
  bool setOptions(const RegistrarOptions& options) override;
  std::string deviceName() const override { return engine_->name(); }
  std::size_t deviceBytes() const override { return engine_->deviceBytes(); }

 private:
  std::string problemOf(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start) const;
  void judge(const PaperProblem& problem, const PaperSolution& solution, const FloatImage& attenuation,
             const MaskImage& mask, bool tracking, RegistrationResult* result);

  RegistrarOptions options_;
  Logger logger_;
  std::unique_ptr<PaperEngine> engine_;
  bool has_volume_ = false;
  AttenuationVolume averaged_;  ///< What the engine has, for the truncated rays.
  Eigen::Vector3d centre_ct_mm_ = Eigen::Vector3d::Zero();
  double radius_mm_ = 1.0;
};

/// Mean local normalised correlation of an X-ray and a DRR over windows of (2 radius + 1)² pixels with CT behind them;
/// −1 … 1, and 0 when no window could be compared.
double meanLocalCorrelation(const FloatImage& xray, const FloatImage& drr, const MaskImage& mask, int radius = 4);

}  // namespace xray_registration

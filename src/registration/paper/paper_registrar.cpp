#include "xray_registration/registration/paper/paper_registrar.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "registration/frame_checks.h"
#include "registration/normal_matrix.h"
#include "xray_registration/common/stopwatch.h"
#include "xray_registration/image/image_pyramid.h"
#include "xray_registration/registration/verdict.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Pixels of the binned X-ray. Finer than the smoothing is noise and what the averaged CT cannot show; coarser than the
/// background is scatter.
constexpr double kSmoothSigmaPx = 1.0;
constexpr double kBackgroundSigmaPx = 4.0;
constexpr double kMinAllowedPixels = 100.0;

/// Whole voxels to average per axis for about `voxels` along the longest side and like spacing on the others.
Eigen::Vector3i averagingFactor(const VolumeGrid& grid, int voxels) {
  const double spacing_mm = grid.size.cast<double>().cwiseProduct(grid.spacing_mm).maxCoeff() / voxels;
  Eigen::Vector3i factor;
  for (int axis = 0; axis < 3; ++axis) {
    factor[axis] = std::max(1, static_cast<int>(std::floor(spacing_mm / grid.spacing_mm[axis] + 1e-6)));
  }
  return factor;
}

/// d(rotation vector in camera axes, rad) / d(θx, θy, θz in degrees) of Rz Ry Rx.
Eigen::Matrix3d rotationByAngles(const Eigen::Vector3d& degrees) {
  const Eigen::Vector3d rad = degrees * (kPi / 180.0);
  const Eigen::Matrix3d rz = Eigen::AngleAxisd(rad.z(), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d ry = Eigen::AngleAxisd(rad.y(), Eigen::Vector3d::UnitY()).toRotationMatrix();
  Eigen::Matrix3d columns;
  columns << rz * ry * Eigen::Vector3d::UnitX(), rz * Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ();
  return columns * (kPi / 180.0);
}

/// The normal matrix for a twist [mm; rad] instead of s = [degrees; mm].
Matrix6d normalOfTwist(const PaperSolution& solution) {
  Matrix6d s_by_twist = Matrix6d::Zero();
  s_by_twist.topRightCorner<3, 3>() = rotationByAngles(solution.s.head<3>()).inverse();
  s_by_twist.bottomLeftCorner<3, 3>().setIdentity();
  return s_by_twist.transpose() * solution.normal * s_by_twist;
}

/// Whether tissue lies at a point of the box's surface (edge coordinates: voxel i fills [i, i + 1]).
bool isTissue(const AttenuationVolume& volume, const Eigen::Vector3d& point) {
  constexpr float kHalfOfWaterPerMm = 0.01F;
  const Eigen::Vector3i top = volume.grid.size - Eigen::Vector3i::Ones();
  const Eigen::Vector3i index = point.array().floor().cast<int>().matrix().cwiseMax(0).cwiseMin(top);
  const auto at = (static_cast<std::size_t>(index.z()) * volume.grid.size.y() + index.y()) * volume.grid.size.x() +
                  static_cast<std::size_t>(index.x());
  return volume.values[at] * volume.scale_per_mm > kHalfOfWaterPerMm;
}

/// Whether the ray through a pixel enters or leaves the grid's box through tissue on a cut face: the body goes on.
bool passesCutFace(const AttenuationVolume& volume, const Eigen::Affine3d& index_from_camera,
                   const Eigen::Vector3d& direction_camera) {
  const Eigen::Vector3d origin = index_from_camera.translation() + Eigen::Vector3d::Constant(0.5);
  const Eigen::Vector3d direction = index_from_camera.linear() * direction_camera;
  double enter = 0.0;
  double leave = std::numeric_limits<double>::infinity();
  int enter_face = -1;
  int leave_face = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double size = volume.grid.size[axis];
    if (std::abs(direction[axis]) < 1e-12) {
      if (origin[axis] < 0.0 || origin[axis] > size) return false;
      continue;
    }
    const double at_low = -origin[axis] / direction[axis];
    const double at_high = (size - origin[axis]) / direction[axis];
    const bool forward = at_low < at_high;
    if (std::min(at_low, at_high) > enter) {
      enter = std::min(at_low, at_high);
      enter_face = 2 * axis + (forward ? 0 : 1);
    }
    if (std::max(at_low, at_high) < leave) {
      leave = std::max(at_low, at_high);
      leave_face = 2 * axis + (forward ? 1 : 0);
    }
  }
  const auto cut = [&](int face, double at) {
    return face >= 0 && volume.face_is_cut[static_cast<std::size_t>(face)] && isTissue(volume, origin + at * direction);
  };
  return enter < leave && (cut(enter_face, enter) || cut(leave_face, leave));
}

/// Rays that the CT cannot explain are left out, with a rim for the motion during the solve. Decided once, at the
/// start: the set of pixels stays the same over the iterations.
void maskTruncatedRays(const AttenuationVolume& volume, const XrayCamera& camera, const RigidTransform& T_camera_ct,
                       MaskImage* mask) {
  if (std::none_of(volume.face_is_cut.begin(), volume.face_is_cut.end(), [](bool cut) { return cut; })) return;
  const Eigen::Affine3d index_from_camera =
      volume.grid.ctFromIndex().inverse() * Eigen::Affine3d(T_camera_ct.inverse().matrix());
  constexpr double kRimPx = 2.0;
  constexpr double kOffsets[5][2] = {{0, 0}, {kRimPx, 0}, {-kRimPx, 0}, {0, kRimPx}, {0, -kRimPx}};
  for (int v = 0; v < mask->height; ++v) {
    for (int u = 0; u < mask->width; ++u) {
      for (const auto& offset : kOffsets) {
        const Eigen::Vector3d ray = camera.rayDirection(u + offset[0], v + offset[1]);
        if (passesCutFace(volume, index_from_camera, ray)) mask->at(u, v) = 0;
      }
    }
  }
}

/// The problem's binning: sides of the X-ray no longer than `pixels`.
int binningFactor(const XrayCamera& camera, int pixels) {
  return std::max(1, (std::max(camera.width, camera.height) + pixels - 1) / pixels);
}

}  // namespace

PaperRegistrar::PaperRegistrar(std::shared_ptr<Device> device, const RegistrarOptions& options, Logger logger)
    : options_(options), logger_(std::move(logger)), engine_(makePaperEngineOpenCl(std::move(device))) {}

bool PaperRegistrar::setOptions(const RegistrarOptions& options) {
  // The CT was averaged for one image size; another method is another class.
  if (options.method != Method::kPaper || options.paper_image_size != options_.paper_image_size) return false;
  options_ = options;
  return true;
}

void PaperRegistrar::setVolume(const AttenuationVolume& volume) {
  has_volume_ = false;
  checkPaperEngine(engine_.get());
  averaged_ = downsampled(volume, averagingFactor(volume.grid, options_.paper_image_size));
  engine_->setVolume(averaged_);
  centre_ct_mm_ = anatomicalCentreCt(volume);
  radius_mm_ = 0.5 * volume.grid.size.cast<double>().cwiseProduct(volume.grid.spacing_mm).norm();
  has_volume_ = true;
  const Eigen::Vector3i size = engine_->grid().size;
  log(logger_, LogLevel::kInfo,
      "paper method: CT averaged to " + std::to_string(size.x()) + "x" + std::to_string(size.y()) + "x" +
          std::to_string(size.z()) + " voxels on " + engine_->name());
}

std::string PaperRegistrar::problemOf(const std::vector<ViewInput>& views,
                                      const RigidTransform& T_camera_ct_start) const {
  if (!has_volume_) return "no CT is loaded";
  if (views.size() != 1) {
    return "the paper's method takes one view, " + std::to_string(views.size()) + " were given (use method fast)";
  }
  return xray_registration::problemOf(views, T_camera_ct_start);
}

RegistrationResult PaperRegistrar::registerFrame(const std::vector<ViewInput>& views,
                                                 const RigidTransform& T_camera_ct_start, bool tracking) {
  RegistrationResult result;
  result.reason = problemOf(views, T_camera_ct_start);
  if (!result.reason.empty()) return result;
  result.T_camera_ct = T_camera_ct_start;
  result.solved = true;

  const Stopwatch watch;
  const XrayFrame& view = *views.front().xray;
  const int factor = binningFactor(view.camera, options_.paper_image_size);
  FloatImage attenuation;
  MaskImage mask;
  binImage(view.attenuation, view.mask, factor, &attenuation, &mask);
  if (options_.truncation_weights) maskTruncatedRays(averaged_, view.camera.binned(factor), T_camera_ct_start, &mask);
  engine_->setTarget(attenuation, mask, PaperFilter{kSmoothSigmaPx, kBackgroundSigmaPx});
  result.upload_ms = watch.milliseconds();

  PaperProblem problem;
  problem.camera = view.camera.binned(factor);
  problem.T_camera_ct_start = T_camera_ct_start;
  problem.centre_ct_mm = centre_ct_mm_;
  problem.samples = paperSampleCount(engine_->grid(), T_camera_ct_start);
  problem.line_integrals = true;
  PaperOptions options;
  options.max_iterations = options_.paper_max_iterations;
  options.stop_norm = options_.paper_stop_norm;
  options.rotation_step_deg = options_.paper_step_deg;
  options.translation_step = options_.paper_step_mm;
  options.gain_and_offset = true;
  const PaperSolution solution = solvePaper(engine_.get(), problem, options);
  judge(problem, solution, attenuation, mask, tracking, &result);
  result.solve_ms = watch.milliseconds();
  return result;
}

void PaperRegistrar::judge(const PaperProblem& problem, const PaperSolution& solution, const FloatImage& attenuation,
                           const MaskImage& mask, bool tracking, RegistrationResult* result) {
  result->T_camera_ct = solution.T_camera_ct;
  result->converged = solution.converged;
  result->iterations = solution.iterations;
  result->residual = solution.residual;
  result->inlier_fraction = 1.0;

  const Matrix6d normal = normalOfTwist(solution);
  result->condition_number = conditionNumber(normal, radius_mm_);
  if (result->condition_number < 1e12) {
    // White noise smoothed by a Gaussian of σ is correlated over 4πσ² pixels: that many are one measurement.
    const double correlation_area = std::max(1.0, 4.0 * kPi * kSmoothSigmaPx * kSmoothSigmaPx);
    result->covariance = solution.residual * solution.residual * correlation_area * normal.inverse();
  }

  engine_->render(0, paperRays(engine_->grid(), problem.camera, solution.T_camera_ct, problem.samples, true));
  result->similarity = meanLocalCorrelation(attenuation, engine_->read(0), mask);

  VerdictCues cues;
  cues.finite = solution.finite && solution.T_camera_ct.matrix().allFinite() && std::isfinite(solution.residual);
  cues.in_view = !solution.left_image;
  cues.converged = solution.converged;
  cues.similarity = result->similarity;
  cues.condition_number = result->condition_number;
  cues.tracking = tracking;
  const Eigen::Vector3d centre_start = problem.T_camera_ct_start * centre_ct_mm_;
  cues.jump_mm = (solution.T_camera_ct * centre_ct_mm_ - centre_start).norm();
  cues.jump_rad = rotationAngleBetween(problem.T_camera_ct_start, solution.T_camera_ct);
  result->reason = solution.reason;
  if (result->reason.empty() && solution.allowed_pixels < kMinAllowedPixels) {
    result->reason = "the mask leaves " + std::to_string(static_cast<int>(solution.allowed_pixels)) +
                     " pixels of the binned X-ray, too few to register";
  }
  // Without a second solve only a sure likeness counts.
  AcceptOptions accept = options_.accept;
  accept.min_similarity = std::max(accept.min_similarity, accept.sure_similarity);
  if (result->reason.empty()) result->reason = reasonToRefuse(cues, accept);
  result->accepted = result->reason.empty();
}

FloatImage PaperRegistrar::renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  if (!has_volume_ || camera.problem()[0] != '\0')
    return FloatImage(std::max(camera.width, 0), std::max(camera.height, 0));
  // Only the size matters: the next frame sets its own target.
  engine_->setTarget(FloatImage(camera.width, camera.height), {}, {});
  engine_->render(
      0, paperRays(engine_->grid(), camera, T_camera_ct, paperSampleCount(engine_->grid(), T_camera_ct), true));
  return engine_->read(0);
}

}  // namespace xray_registration

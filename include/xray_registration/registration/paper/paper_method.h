#pragma once

#include <array>
#include <string>

#include "xray_registration/drr/paper/paper_engine.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"

namespace xray_registration {

/// s = (θx, θy, θz, τx, τy, τz) of the paper: angles in degrees, translation in `unit_mm` (1: millimetres; the side of
/// the cube in the paper's first experiment).
using PaperParameters = Eigen::Matrix<double, 6, 1>;

/// What is registered: T_camera_ct(s) = Trans(unit τ) Trans(c) Rz Ry Rx Trans(−c) T_camera_ct_start, in camera axes
/// about c, the point centre_ct_mm at the start. The paper leaves the order of the rotations open.
struct PaperProblem {
  XrayCamera camera;
  RigidTransform T_camera_ct_start = RigidTransform::Identity();
  Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();
  double unit_mm = 1.0;
  int samples = 2;              ///< Per ray, m = 3 Lz.
  bool line_integrals = false;  ///< Samples weighted in mm; the paper's pixel is the plain sum.
};

struct PaperOptions {
  int max_iterations = 30;
  double stop_norm = 0.1;          ///< Stops when ‖Δs‖₂ is below, in the units of s.
  double rotation_step_deg = 0.5;  ///< Forward differences; left open by the paper.
  double translation_step = 0.5;   ///< In units.
  /// Two more unknowns, g ≈ gain · f(s) + offset, eliminated in every step: for X-rays.
  bool gain_and_offset = false;
  bool time_parts = false;  ///< Waits for the device between the parts, so that their times can be told apart.
};

struct PaperSolution {
  PaperParameters s = PaperParameters::Zero();
  RigidTransform T_camera_ct = RigidTransform::Identity();
  bool converged = false;
  std::string reason;  ///< Why a step was refused or the iteration ended early, in plain words; empty otherwise.
  bool left_image = false;
  bool finite = true;
  int iterations = 0;
  double gain = 1.0;
  double offset = 0.0;
  double residual = 0.0;  ///< Root mean square over the allowed pixels, before the last step.
  double allowed_pixels = 0.0;
  Matrix6d normal =
      Matrix6d::Zero();  ///< Of the last step, in the units of s, gain and offset eliminated; times gain².
  double drr_ms = 0.0;
  double other_ms = 0.0;  ///< Reduction, transfer, elimination. Meaningful with time_parts.
};

/// The pose that s describes.
RigidTransform paperPose(const PaperProblem& problem, const PaperParameters& s);

/// One step from sums: Δs and what it used. `reason` is empty when the system could be solved.
struct PaperStep {
  PaperParameters delta = PaperParameters::Zero();
  Matrix6d normal = Matrix6d::Zero();
  double gain = 1.0;
  double offset = 0.0;
  std::string reason;
};
PaperStep paperStep(const PaperMoments& moments, bool gain_and_offset);

/// Gauss-Newton of the paper with forward differences: seven DRRs a step, sums on the engine, the 6×6 system by
/// elimination with pivoting on the host. The engine has its volume and target. A singular system, a number that is not
/// finite, or a pose that leaves the image refuses the step: the last good pose stays, converged is false, and the
/// reason is given. @throws DeviceError.
PaperSolution solvePaper(PaperEngine* engine, const PaperProblem& problem, const PaperOptions& options);

/// Whether the CT's centre lies in front of the source and projects into the image.
bool centreInView(const XrayCamera& camera, const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm);

}  // namespace xray_registration

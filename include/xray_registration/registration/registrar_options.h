#pragma once

#include <cstddef>
#include <string>

#include "xray_registration/drr/similarity.h"

namespace xray_registration {

enum class Method { kFast, kPaper };

/// Of a body beside the rest (parameters accept/body_…); docs/accuracy.md has the data.
struct BodyAcceptOptions {
  double min_similarity = 0.45;  ///< Of what the rest leaves unexplained.
  double min_inlier_fraction = 0.3;
  double min_margin = 0.03;        ///< Of a cold start, above the best other place.
  double max_overlap_mm3 = 300.0;  ///< Of two bodies: bones are solid.
};

/// Thresholds of the verdict (parameters accept/…); docs/accuracy.md has the data behind the defaults.
struct AcceptOptions {
  double min_similarity = 0.45;          ///< Whatever else speaks for a result.
  double min_similarity_one_view = 0.6;  ///< One view has more look-alikes than several.
  double min_inlier_fraction = 0.3;
  double min_inlier_fraction_one_view = 0.35;
  double alone_similarity = 0.54;  ///< What was not compared with other places needs as much.
  double alone_similarity_one_view = 0.7;
  double alone_inlier_fraction = 0.3;
  double alone_inlier_fraction_one_view = 0.75;
  double sure_similarity = 0.8;  ///< Below it, a cold start is solved a second time and compared with other places.
  double max_condition_number = 1.0e6;
  double max_jump_mm = 30.0;  ///< While tracking: distance of the CT centre from the prediction.
  double max_jump_rad = 0.35;
  double min_margin = 0.03;             ///< A cold start that is not sure: similarity above the best other place's.
  double clear_margin = 0.06;           ///< So far above it, a cold start need not be found twice.
  double max_setup_error_mm = 1.0;      ///< How much a wrong input may move the pose.
  double max_residual_motion_mm = 0.3;  ///< What may still move in the images where the pose is right.
  double max_disagreement_mm = 1.0;     ///< Between the two solves, in-plane, mean over 60 mm around the CT's centre.
  BodyAcceptOptions body;
};

/// What calibration left open, one σ (parameters geometry/… and ct/scale_sigma): part of the pose's covariance. The
/// defaults are those of a C-arm whose geometry comes from its own angles and distances.
struct SetupSigmas {
  double focal_length = 0.01;        ///< Of itself.
  double principal_point_px = 1.0;   ///< Each axis, pixels of the image as it comes.
  double view_rotation_deg = 0.2;    ///< Each axis: of a further view against the first.
  double view_translation_mm = 0.5;  ///< Each axis, at the CT.
  double ct_scale = 0.005;           ///< Of the CT's size.
};

/// Tuning of both methods (parameters solver/…). Lengths in mm, angles in rad.
struct RegistrarOptions {
  Method method = Method::kFast;
  Similarity similarity = Similarity::kLocalNormalised;
  AcceptOptions accept;
  SetupSigmas setup;
  int check_every = 30;  ///< Frames between two looks at whether what was told is right; 0: never, not even at a cold
                         ///< start.

  // Fast method.
  int max_steps_per_frame = 1000;    ///< Evaluations of the objective, whatever for: bounds the latency.
  double max_image_pixels = 100000;  ///< A view is binned until no more of its pixels have CT behind them.
  /// Tracked frames are looked at on the coarsest level on which the pose's in-plane σ is still below this, if there is
  /// one coarser than the finest; 0: always the finest.
  double tracking_precision_mm = 0.015;
  bool search = true;  ///< Without an accepted neighbour: search around the start before the descent.
  double search_rotation_rad = 0.22;
  double search_translation_mm = 22.0;
  int search_poses = 96;
  double reach_rotation_rad = 0.0;    ///< Further from a cold start's pose nothing is believed, nor compared with;
  double reach_translation_mm = 0.0;  ///< 0: twice what is searched, unless the result is sure.
  double saturation = 0.0;  ///< Line integral at which DRRs saturate (ResidentXray::setSaturation); 0: they do not.
  bool robust_weights = true;
  bool truncation_weights = true;

  // The paper's method.
  int paper_max_iterations = 30;
  double paper_stop_norm = 0.1;  ///< ‖Δs‖₂, degrees and millimetres.
  double paper_step_deg = 0.5;   ///< Finite differences.
  double paper_step_mm = 0.5;
  int paper_image_size = 128;  ///< X-rays are binned until no side is longer.
};

/// Whether a solver that went by one of them may go on by the other: all but the verdict's thresholds is the same.
bool solvesAlike(const RegistrarOptions& a, const RegistrarOptions& b);

}  // namespace xray_registration

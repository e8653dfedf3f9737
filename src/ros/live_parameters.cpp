#include "live_parameters.h"

namespace xray_registration {
namespace {

// The fields have the same names on both sides: one list serves both directions.

template <typename From, typename To>
void copyAccept(const From& from, To* to) {
  to->min_similarity = from.min_similarity;
  to->min_similarity_one_view = from.min_similarity_one_view;
  to->sure_similarity = from.sure_similarity;
  to->min_inlier_fraction = from.min_inlier_fraction;
  to->min_inlier_fraction_one_view = from.min_inlier_fraction_one_view;
  to->alone_similarity = from.alone_similarity;
  to->alone_similarity_one_view = from.alone_similarity_one_view;
  to->alone_inlier_fraction = from.alone_inlier_fraction;
  to->alone_inlier_fraction_one_view = from.alone_inlier_fraction_one_view;
  to->max_condition_number = from.max_condition_number;
  to->max_jump_mm = from.max_jump_mm;
  to->max_jump_rad = from.max_jump_rad;
  to->max_disagreement_mm = from.max_disagreement_mm;
  to->min_margin = from.min_margin;
  to->clear_margin = from.clear_margin;
  to->max_setup_error_mm = from.max_setup_error_mm;
  to->max_residual_motion_mm = from.max_residual_motion_mm;
}

/// All but the similarity, which is a text on one side.
template <typename From, typename To>
void copySolver(const From& from, To* to) {
  to->max_steps_per_frame = from.max_steps_per_frame;
  to->max_image_pixels = from.max_image_pixels;
  to->tracking_precision_mm = from.tracking_precision_mm;
  to->search = from.search;
  to->search_rotation_rad = from.search_rotation_rad;
  to->search_translation_mm = from.search_translation_mm;
  to->search_poses = from.search_poses;
  to->robust_weights = from.robust_weights;
  to->truncation_weights = from.truncation_weights;
  to->check_every = from.check_every;
}

template <typename From, typename To>
void copyTracking(const From& from, To* to) {
  to->frames_until_lost = from.frames_until_lost;
  to->max_prediction_gap_s = from.max_prediction_gap_s;
  to->max_velocity_mm_s = from.max_velocity_mm_s;
  to->max_velocity_rad_s = from.max_velocity_rad_s;
}

}  // namespace

AcceptConfig toConfig(const AcceptOptions& options) {
  AcceptConfig config = AcceptConfig::__getDefault__();
  copyAccept(options, &config);
  return config;
}

SolverConfig toConfig(const RegistrarOptions& options) {
  SolverConfig config = SolverConfig::__getDefault__();
  config.similarity = kindOf(options.similarity).name;
  copySolver(options, &config);
  return config;
}

TrackingConfig toConfig(const TrackerOptions& options) {
  TrackingConfig config = TrackingConfig::__getDefault__();
  copyTracking(options, &config);
  return config;
}

void apply(const AcceptConfig& config, AcceptOptions* options) { copyAccept(config, options); }

void apply(const SolverConfig& config, RegistrarOptions* options) {
  // dynamic_reconfigure does not hold a text to its enumeration: another one keeps the present choice.
  options->similarity = similarityNamed(config.similarity).value_or(options->similarity);
  copySolver(config, options);
}

void apply(const TrackingConfig& config, TrackerOptions* options) { copyTracking(config, options); }

}  // namespace xray_registration

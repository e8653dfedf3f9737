#include "live_parameters.h"

namespace xray_registration {

AcceptConfig toConfig(const AcceptOptions& options) {
  AcceptConfig config = AcceptConfig::__getDefault__();
  config.min_similarity = options.min_similarity;
  config.min_similarity_one_view = options.min_similarity_one_view;
  config.sure_similarity = options.sure_similarity;
  config.min_inlier_fraction = options.min_inlier_fraction;
  config.min_inlier_fraction_one_view = options.min_inlier_fraction_one_view;
  config.max_condition_number = options.max_condition_number;
  config.max_jump_mm = options.max_jump_mm;
  config.max_jump_rad = options.max_jump_rad;
  config.max_disagreement_mm = options.max_disagreement_mm;
  return config;
}

SolverConfig toConfig(const RegistrarOptions& options) {
  SolverConfig config = SolverConfig::__getDefault__();
  config.similarity = options.similarity == Similarity::kLocalNormalised ? "local_normalised" : "gain_offset";
  config.max_steps_per_frame = options.max_steps_per_frame;
  config.max_image_pixels = options.max_image_pixels;
  config.search = options.search;
  config.search_rotation_rad = options.search_rotation_rad;
  config.search_translation_mm = options.search_translation_mm;
  config.search_poses = options.search_poses;
  config.robust_weights = options.robust_weights;
  config.truncation_weights = options.truncation_weights;
  return config;
}

TrackingConfig toConfig(const TrackerOptions& options) {
  TrackingConfig config = TrackingConfig::__getDefault__();
  config.frames_until_lost = options.frames_until_lost;
  config.max_prediction_gap_s = options.max_prediction_gap_s;
  config.max_velocity_mm_s = options.max_velocity_mm_s;
  config.max_velocity_rad_s = options.max_velocity_rad_s;
  return config;
}

void apply(const AcceptConfig& config, AcceptOptions* options) {
  options->min_similarity = config.min_similarity;
  options->min_similarity_one_view = config.min_similarity_one_view;
  options->sure_similarity = config.sure_similarity;
  options->min_inlier_fraction = config.min_inlier_fraction;
  options->min_inlier_fraction_one_view = config.min_inlier_fraction_one_view;
  options->max_condition_number = config.max_condition_number;
  options->max_jump_mm = config.max_jump_mm;
  options->max_jump_rad = config.max_jump_rad;
  options->max_disagreement_mm = config.max_disagreement_mm;
}

void apply(const SolverConfig& config, RegistrarOptions* options) {
  // dynamic_reconfigure does not hold a text to its enumeration: another one keeps the present choice.
  if (config.similarity == "local_normalised") options->similarity = Similarity::kLocalNormalised;
  if (config.similarity == "gain_offset") options->similarity = Similarity::kGainOffset;
  options->max_steps_per_frame = config.max_steps_per_frame;
  options->max_image_pixels = config.max_image_pixels;
  options->search = config.search;
  options->search_rotation_rad = config.search_rotation_rad;
  options->search_translation_mm = config.search_translation_mm;
  options->search_poses = config.search_poses;
  options->robust_weights = config.robust_weights;
  options->truncation_weights = config.truncation_weights;
}

void apply(const TrackingConfig& config, TrackerOptions* options) {
  options->frames_until_lost = config.frames_until_lost;
  options->max_prediction_gap_s = config.max_prediction_gap_s;
  options->max_velocity_mm_s = config.max_velocity_mm_s;
  options->max_velocity_rad_s = config.max_velocity_rad_s;
}

}  // namespace xray_registration

#include "live_parameters.h"

#include <cmath>
#include <map>

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

template <typename Config>
std::string notANumber(const Config& config) {
  dynamic_reconfigure::Config message;
  config.__toMessage__(message);
  for (const dynamic_reconfigure::DoubleParameter& parameter : message.doubles) {
    if (std::isnan(parameter.value)) return parameter.name + " is not a number";
  }
  return "";
}

/// Name → kind of value.
std::map<std::string, std::string> kindsOf(const dynamic_reconfigure::Config& message) {
  std::map<std::string, std::string> kinds;
  for (const auto& parameter : message.bools) kinds[parameter.name] = "true or false";
  for (const auto& parameter : message.ints) kinds[parameter.name] = "a whole number";
  for (const auto& parameter : message.doubles) kinds[parameter.name] = "a number";
  for (const auto& parameter : message.strs) kinds[parameter.name] = "a text";
  return kinds;
}

std::size_t countOf(const dynamic_reconfigure::Config& message) {
  return message.bools.size() + message.ints.size() + message.doubles.size() + message.strs.size();
}

std::string unknownName(const std::string& name, const std::map<std::string, std::string>& kinds) {
  std::string allowed;
  for (const auto& [other, unused] : kinds) allowed += (allowed.empty() ? "" : ", ") + other;
  return "there is no parameter '" + name + "'; allowed: " + allowed;
}

std::string otherKind(const std::string& name, const std::string& given, const std::string& allowed) {
  return name + " is given as " + given + "; allowed: " + allowed;
}

}  // namespace

std::string unknownParameter(const dynamic_reconfigure::Config& asked, const dynamic_reconfigure::Config& known) {
  const std::map<std::string, std::string> kinds = kindsOf(known);
  const std::map<std::string, std::string> asked_kinds = kindsOf(asked);
  for (const auto& [name, kind] : asked_kinds) {
    const auto found = kinds.find(name);
    if (found == kinds.end()) return unknownName(name, kinds);
    if (found->second != kind) return otherKind(name, kind, found->second);
  }
  return asked_kinds.size() == countOf(asked) ? "" : "a parameter is given twice";
}

std::string problemOf(const AcceptConfig& config) { return notANumber(config); }

std::string problemOf(const TrackingConfig& config) { return notANumber(config); }

std::string problemOf(const SolverConfig& config) {
  if (similarityNamed(config.similarity)) return notANumber(config);
  std::string allowed;
  for (const SimilarityKind& kind : kSimilarities) allowed += (allowed.empty() ? "" : ", ") + std::string(kind.name);
  return "similarity is '" + config.similarity + "'; allowed: " + allowed;
}

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
  // problemOf() has seen to it that there is one.
  options->similarity = similarityNamed(config.similarity).value_or(options->similarity);
  copySolver(config, options);
}

void apply(const TrackingConfig& config, TrackerOptions* options) { copyTracking(config, options); }

}  // namespace xray_registration

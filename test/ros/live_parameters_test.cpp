#include "ros/live_parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "xray_registration/pipeline/parameters.h"

namespace xray_registration {
namespace {

/// The flags, integers and numbers of a configuration of dynamic_reconfigure, by name.
template <typename Config>
std::map<std::string, double> numbersOf(const Config& config) {
  dynamic_reconfigure::Config message;
  config.__toMessage__(message);
  std::map<std::string, double> numbers;
  for (const auto& one : message.bools) numbers[one.name] = one.value;
  for (const auto& one : message.ints) numbers[one.name] = one.value;
  for (const auto& one : message.doubles) numbers[one.name] = one.value;
  return numbers;
}

// config/default.yaml is where users read the defaults: it must hold those of the code, all of them.
TEST(ConfigurationFiles, DefaultHoldsTheDefaults) {
  const NodeParameters file = loadParametersYaml(XRAY_REGISTRATION_SOURCE "/config/default.yaml");
  const NodeParameters code;
  EXPECT_EQ(file.ct.read.hu_slope, code.ct.read.hu_slope);
  EXPECT_EQ(file.ct.read.hu_intercept, code.ct.read.hu_intercept);
  EXPECT_EQ(file.ct.read.padding, code.ct.read.padding);
  EXPECT_EQ(file.ct.read.check_values, code.ct.read.check_values);
  EXPECT_EQ(file.ct.read.orientation, code.ct.read.orientation);
  EXPECT_EQ(file.ct.read.unit_mm, code.ct.read.unit_mm);
  EXPECT_EQ(file.ct.model.water_per_mm, code.ct.model.water_per_mm);
  EXPECT_EQ(file.ct.model.threshold_hu, code.ct.model.threshold_hu);
  EXPECT_EQ(file.ct.surface_threshold_hu, code.ct.surface_threshold_hu);
  EXPECT_EQ(file.ct.surface_triangles, code.ct.surface_triangles);
  EXPECT_EQ(file.registrar.setup.ct_scale, code.registrar.setup.ct_scale);
  EXPECT_EQ(file.registrar.setup.focal_length, code.registrar.setup.focal_length);
  EXPECT_EQ(file.registrar.setup.principal_point_px, code.registrar.setup.principal_point_px);
  EXPECT_EQ(file.registrar.setup.view_rotation_deg, code.registrar.setup.view_rotation_deg);
  EXPECT_EQ(file.registrar.setup.view_translation_mm, code.registrar.setup.view_translation_mm);
  EXPECT_EQ(file.recover, code.recover);
  EXPECT_EQ(file.localize.nearest_mm, code.localize.nearest_mm);
  EXPECT_EQ(file.localize.farthest_mm, code.localize.farthest_mm);
  EXPECT_EQ(file.localize.centre_frame, code.localize.centre_frame);
  EXPECT_EQ(file.localize.centre_range_mm, code.localize.centre_range_mm);
  EXPECT_EQ(file.calibration_frames, code.calibration_frames);
  EXPECT_EQ(file.image.linearize.kind, code.image.linearize.kind);
  EXPECT_EQ(file.image.find.collimator, code.image.find.collimator);
  EXPECT_EQ(file.image.find.letters, code.image.find.letters);
  EXPECT_EQ(file.image.find.metal, code.image.find.metal);
  EXPECT_EQ(file.frames.ct, code.frames.ct);
  EXPECT_EQ(file.frames.tf_timeout_s, code.frames.tf_timeout_s);
  EXPECT_EQ(file.frames.allow_change, code.frames.allow_change);
  EXPECT_EQ(file.sync.tolerance_s, code.sync.tolerance_s);
  EXPECT_EQ(file.stamps.max_ahead_s, code.stamps.max_ahead_s);
  EXPECT_EQ(file.stamps.max_jump_s, code.stamps.max_jump_s);
  EXPECT_EQ(file.stamps.max_late_s, code.stamps.max_late_s);
  EXPECT_EQ(file.stamps.frames_until_new, code.stamps.frames_until_new);
  EXPECT_EQ(file.health.hold_timeout_s, code.health.hold_timeout_s);
  EXPECT_EQ(file.health.image_age_warn_s, code.health.image_age_warn_s);
  EXPECT_EQ(file.health.image_age_error_s, code.health.image_age_error_s);
  EXPECT_EQ(file.health.pose_age_warn_s, code.health.pose_age_warn_s);
  EXPECT_EQ(file.health.pose_age_error_s, code.health.pose_age_error_s);
  EXPECT_EQ(file.health.min_rate_hz, code.health.min_rate_hz);
  EXPECT_EQ(file.health.max_dropped, code.health.max_dropped);
  EXPECT_EQ(file.sync.patience_s, code.sync.patience_s);
  EXPECT_EQ(numbersOf(toConfig(file.registrar.accept)), numbersOf(toConfig(code.registrar.accept)));
  EXPECT_EQ(numbersOf(toConfig(file.registrar)), numbersOf(toConfig(code.registrar)));
  EXPECT_EQ(numbersOf(toConfig(file.tracker)), numbersOf(toConfig(code.tracker)));
  EXPECT_EQ(file.registrar.similarity, code.registrar.similarity);
  EXPECT_EQ(file.registrar.paper_max_iterations, code.registrar.paper_max_iterations);
  EXPECT_EQ(file.registrar.paper_stop_norm, code.registrar.paper_stop_norm);
  EXPECT_EQ(file.registrar.paper_step_deg, code.registrar.paper_step_deg);
  EXPECT_EQ(file.registrar.paper_step_mm, code.registrar.paper_step_mm);
  EXPECT_EQ(file.registrar.paper_image_size, code.registrar.paper_image_size);
}

// cfg/*.cfg repeats the defaults for rqt_reconfigure.
TEST(LiveParameters, HaveTheSameDefaults) {
  EXPECT_EQ(numbersOf(AcceptConfig::__getDefault__()), numbersOf(toConfig(AcceptOptions{})));
  EXPECT_EQ(numbersOf(SolverConfig::__getDefault__()), numbersOf(toConfig(RegistrarOptions{})));
  EXPECT_EQ(numbersOf(TrackingConfig::__getDefault__()), numbersOf(toConfig(TrackerOptions{})));
  EXPECT_EQ(SolverConfig::__getDefault__().similarity, toConfig(RegistrarOptions{}).similarity);
}

/// Bounds that differ from the defaults arrive in the options and come back.
template <typename Config, typename Options>
void expectEveryFieldIsCarried() {
  const std::map<std::string, double> minima = numbersOf(Config::__getMin__());
  const std::map<std::string, double> defaults = numbersOf(Config::__getDefault__());
  for (const auto& [name, least] : minima) EXPECT_NE(least, defaults.at(name)) << name << " proves nothing";
  Options options;
  apply(Config::__getMin__(), &options);
  EXPECT_EQ(numbersOf(toConfig(options)), minima);
}

TEST(LiveParameters, EveryFieldIsCarriedBothWays) {
  expectEveryFieldIsCarried<AcceptConfig, AcceptOptions>();
  expectEveryFieldIsCarried<SolverConfig, RegistrarOptions>();
  expectEveryFieldIsCarried<TrackingConfig, TrackerOptions>();
}

TEST(LiveParameters, EverySimilarityIsOffered) {
  std::string offered;
  for (const auto& parameter : SolverConfig::__getParamDescriptions__()) {
    if (parameter->name == "similarity") offered = parameter->edit_method;
  }
  for (const SimilarityKind& kind : kSimilarities) {
    EXPECT_NE(offered.find("'" + std::string(kind.name) + "'"), std::string::npos) << offered;
    SolverConfig config = SolverConfig::__getDefault__();
    config.similarity = kind.name;
    RegistrarOptions options;
    apply(config, &options);
    EXPECT_EQ(options.similarity, kind.similarity);
    EXPECT_EQ(toConfig(options).similarity, kind.name);
  }
}

TEST(LiveParameters, ApplyWhatTheyShow) {
  RegistrarOptions options;
  SolverConfig config = toConfig(options);
  config.similarity = "gain_offset";
  config.max_steps_per_frame = 7;
  apply(config, &options);
  EXPECT_EQ(options.similarity, Similarity::kGainOffset);
  EXPECT_EQ(options.max_steps_per_frame, 7);
  config.similarity = "nonsense";
  apply(config, &options);
  EXPECT_EQ(options.similarity, Similarity::kGainOffset);
}

TEST(LiveParameters, NumbersThatAreNoneAndUnknownWordsAreProblems) {
  AcceptConfig accept = toConfig(AcceptOptions{});
  EXPECT_EQ(problemOf(accept), "");
  accept.min_similarity = std::nan("");
  EXPECT_EQ(problemOf(accept), "min_similarity is not a number");
  TrackingConfig tracking = toConfig(TrackerOptions{});
  EXPECT_EQ(problemOf(tracking), "");
  tracking.max_velocity_mm_s = std::nan("");
  EXPECT_EQ(problemOf(tracking), "max_velocity_mm_s is not a number");
  SolverConfig solver = toConfig(RegistrarOptions{});
  EXPECT_EQ(problemOf(solver), "");
  solver.search_rotation_rad = std::nan("");
  EXPECT_EQ(problemOf(solver), "search_rotation_rad is not a number");
  solver = toConfig(RegistrarOptions{});
  solver.similarity = "nonsense";
  EXPECT_NE(problemOf(solver).find("'nonsense'; allowed: local_normalised, "), std::string::npos) << problemOf(solver);
}

TEST(LiveParameters, WhatARequestCannotMeanIsAProblem) {
  dynamic_reconfigure::Config known;
  toConfig(TrackerOptions{}).__toMessage__(known);
  EXPECT_EQ(unknownParameter({}, known), "");
  EXPECT_EQ(unknownParameter(known, known), "");
  dynamic_reconfigure::Config asked;
  asked.ints.resize(1);
  asked.ints[0].name = "frames_until_lost";
  EXPECT_EQ(unknownParameter(asked, known), "");
  asked.ints.push_back(asked.ints[0]);
  EXPECT_EQ(unknownParameter(asked, known), "a parameter is given twice");
  asked.ints[1].name = "frames";
  EXPECT_EQ(unknownParameter(asked, known),
            "there is no parameter 'frames'; allowed: frames_until_lost, max_prediction_gap_s, max_velocity_mm_s, "
            "max_velocity_rad_s");
  asked.ints[1].name = "max_velocity_mm_s";
  EXPECT_EQ(unknownParameter(asked, known), "max_velocity_mm_s is given as a whole number; allowed: a number");
}

}  // namespace
}  // namespace xray_registration

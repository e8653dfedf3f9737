#include "xray_registration/ros/parameters.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <set>

#include "ros/live_parameters.h"

namespace xray_registration {
namespace {

NodeParameters parse(const std::string& yaml, std::vector<std::string>* warnings = nullptr) {
  return parseParameters(YAML::Load(yaml), [&](LogLevel, const std::string& text) {
    if (warnings != nullptr) warnings->push_back(text);
  });
}

std::string reasonOf(const std::string& yaml) {
  try {
    parse(yaml);
  } catch (const ParameterError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Parameters, HaveDefaults) {
  const NodeParameters parameters = parse("{}");
  EXPECT_EQ(parameters.ct.model.water_per_mm, 0.02);
  EXPECT_EQ(parameters.device, "auto");
  EXPECT_TRUE(parameters.frames.publish_tf);
  EXPECT_FALSE(parameters.initial_pose);
  EXPECT_EQ(parameters.viewNames(), std::vector<std::string>{""});
}

TEST(Parameters, AreRead) {
  const NodeParameters parameters = parse(R"(
ct: {path: /tmp/a.nii, series_uid: "1.2.3", directory: /tmp, water_attenuation: 0.019, threshold_hu: -700, label: 3}
image: {kind: inverted, find_metal: false, masks: {oblique: b.png}}
views: [ap, oblique]
sync: {tolerance: 0.5, allow_missing_view: true}
device: gpu
prepare_ahead: never
method: paper
mode: on_demand
frames: {ct: bone, fixed: room}
invert_tf: true
initial_pose: {position: [0.1, 0, 1], orientation: [0, 0, 0, 1], frame_id: room}
accept: {min_similarity: 0.7}
solver: {similarity: gain_offset, max_steps_per_frame: 12}
tracking: {frames_until_lost: 2})");
  EXPECT_EQ(parameters.ct.path, "/tmp/a.nii");
  EXPECT_EQ(parameters.ct.read.series_uid, "1.2.3");
  EXPECT_EQ(parameters.ct.model.threshold_hu, -700.0);
  EXPECT_EQ(parameters.image.linearize.kind, ImageKind::kInverted);
  EXPECT_FALSE(parameters.image.find.metal);
  EXPECT_EQ(parameters.image.masks.at("oblique"), "b.png");
  EXPECT_EQ(parameters.viewNames().size(), 2U);
  EXPECT_EQ(parameters.registrar.method, Method::kPaper);
  EXPECT_EQ(parameters.mode, Mode::kOnDemand);
  EXPECT_EQ(parameters.frames.fixed, "room");
  ASSERT_TRUE(parameters.initial_pose);
  EXPECT_DOUBLE_EQ(parameters.initial_pose->translation().x(), 100.0);
  EXPECT_EQ(parameters.initial_pose_frame, "room");
  EXPECT_EQ(parameters.registrar.accept.min_similarity, 0.7);
  EXPECT_EQ(parameters.registrar.similarity, Similarity::kGainOffset);
  EXPECT_EQ(parameters.tracker.frames_until_lost, 2);
}

TEST(Parameters, RefusalsNameParameterValueAndWhatIsAllowed) {
  struct Case {
    const char* yaml;
    std::vector<const char*> words;
  };
  const std::vector<Case> cases = {
      {"{ct: {water_attenuation: -1}}", {"ct/water_attenuation", "-1", "0.0001 to 1"}},
      {"{ct: {water_attenuation: wet}}", {"ct/water_attenuation", "wet", "number"}},
      {"{ct: {water_attenuation: .nan}}", {"ct/water_attenuation", "nan"}},
      {"{ct: {label: 0}}", {"ct/label", "0", "1 to 65535"}},
      {"{ct: {label: 1.5}}", {"ct/label", "1.5", "whole"}},
      {"{ct: 3}", {"ct", "3", "group"}},
      {"{image: {kind: negative}}", {"image/kind", "negative", "transmission", "inverted"}},
      {"{image: {find_metal: maybe}}", {"image/find_metal", "maybe", "true or false"}},
      {"{method: slow}", {"method", "slow", "fast", "paper"}},
      {"{mode: sometimes}", {"mode", "sometimes", "on_demand"}},
      {"{views: [ap, ap]}", {"views", "ap", "twice"}},
      {"{views: [a b]}", {"views", "a b"}},
      {"{views: {a: 1}}", {"views", "list"}},
      {"{frames: {ct: ''}}", {"frames/ct"}},
      {"{frames: {ct: /ct}}", {"frames/ct", "/ct"}},
      {"{frames: {fixed: ct}}", {"frames/fixed", "ct"}},
      {"{accept: {min_similarity: 2}}", {"accept/min_similarity", "2"}},
      {"{solver: {max_steps_per_frame: 0}}", {"solver/max_steps_per_frame", "0"}},
      {"{tracking: {frames_until_lost: -1}}", {"tracking/frames_until_lost", "-1"}},
      {"{sync: {tolerance: -0.1}}", {"sync/tolerance", "-0.1"}},
      {"{accept: {min_similarty: 0.5}}", {"accept/min_similarty", "not known", "min_similarity"}},
      {"{views: [ap], image: {masks: {lateral: x.png}}}", {"image/masks/lateral", "not known", "ap"}},
      {"{initial_pose: {position: [0, 0, 1], orientation: [0, 0, 0, 0]}}", {"initial_pose/orientation", "length"}},
      {"{initial_pose: {position: [0, 0], orientation: [0, 0, 0, 1]}}", {"initial_pose", "position"}},
      {"{initial_pose: [0, 0, 1]}", {"initial_pose", "position"}},
      {"{initial_pose: {position: [0, 0, .inf], orientation: [0, 0, 0, 1]}}", {"initial_pose"}},
      {"{drr_encoding: rgb8}", {"drr_encoding", "rgb8", "mono8", "32FC1"}},
      {"{device: ''}", {"device"}},
  };
  for (const Case& one : cases) {
    const std::string reason = reasonOf(one.yaml);
    for (const char* word : one.words) EXPECT_NE(reason.find(word), std::string::npos) << one.yaml << " → " << reason;
  }
}

TEST(Parameters, UnknownNamesBesideTheGroupsAreWarnedOf) {
  std::vector<std::string> warnings;
  parse("{methd: paper}", &warnings);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("methd"), std::string::npos);
}

TEST(Parameters, NoneMeansNoInitialPose) { EXPECT_FALSE(parse("{initial_pose: none}").initial_pose); }

TEST(Parameters, MissingFileIsNamed) {
  try {
    loadParametersYaml("/nowhere/x.yaml");
    FAIL();
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/x.yaml"), std::string::npos);
  }
}

// Every configuration that is shipped must load, without a warning.
TEST(ConfigurationFiles, AllLoad) {
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(XRAY_REGISTRATION_SOURCE "/config")) {
    if (entry.path().extension() != ".yaml") continue;
    ++count;
    EXPECT_NO_THROW(loadParametersYaml(entry.path().string(), [&](LogLevel, const std::string& text) {
      ADD_FAILURE() << entry.path() << ": " << text;
    }));
  }
  EXPECT_GE(count, 5);
}

// config/default.yaml is where users read the defaults: it must hold those of the code, all of them.
TEST(ConfigurationFiles, DefaultHoldsTheDefaults) {
  const NodeParameters file = loadParametersYaml(XRAY_REGISTRATION_SOURCE "/config/default.yaml");
  const NodeParameters code;
  EXPECT_EQ(file.ct.model.water_per_mm, code.ct.model.water_per_mm);
  EXPECT_EQ(file.ct.model.threshold_hu, code.ct.model.threshold_hu);
  EXPECT_EQ(file.ct.surface_threshold_hu, code.ct.surface_threshold_hu);
  EXPECT_EQ(file.ct.surface_triangles, code.ct.surface_triangles);
  EXPECT_EQ(file.image.linearize.kind, code.image.linearize.kind);
  EXPECT_EQ(file.image.find.collimator, code.image.find.collimator);
  EXPECT_EQ(file.image.find.letters, code.image.find.letters);
  EXPECT_EQ(file.image.find.metal, code.image.find.metal);
  EXPECT_EQ(file.frames.ct, code.frames.ct);
  EXPECT_EQ(file.frames.tf_timeout_s, code.frames.tf_timeout_s);
  EXPECT_EQ(file.sync.tolerance_s, code.sync.tolerance_s);
  EXPECT_EQ(file.sync.patience_s, code.sync.patience_s);
  const AcceptConfig accept = toConfig(file.registrar.accept);
  const AcceptConfig accept_code = toConfig(code.registrar.accept);
  EXPECT_EQ(accept.min_similarity, accept_code.min_similarity);
  EXPECT_EQ(accept.min_inlier_fraction, accept_code.min_inlier_fraction);
  EXPECT_EQ(accept.max_condition_number, accept_code.max_condition_number);
  EXPECT_EQ(accept.max_jump_mm, accept_code.max_jump_mm);
  EXPECT_EQ(accept.max_jump_rad, accept_code.max_jump_rad);
  EXPECT_EQ(accept.max_disagreement_mm, accept_code.max_disagreement_mm);
  EXPECT_EQ(file.registrar.max_steps_per_frame, code.registrar.max_steps_per_frame);
  EXPECT_EQ(file.registrar.max_image_pixels, code.registrar.max_image_pixels);
  EXPECT_EQ(file.registrar.robust_weights, code.registrar.robust_weights);
  EXPECT_EQ(file.registrar.truncation_weights, code.registrar.truncation_weights);
  EXPECT_EQ(file.registrar.paper_max_iterations, code.registrar.paper_max_iterations);
  EXPECT_EQ(file.registrar.paper_stop_norm, code.registrar.paper_stop_norm);
  EXPECT_EQ(file.registrar.paper_step_deg, code.registrar.paper_step_deg);
  EXPECT_EQ(file.registrar.paper_step_mm, code.registrar.paper_step_mm);
  EXPECT_EQ(file.registrar.paper_image_size, code.registrar.paper_image_size);
  EXPECT_EQ(file.tracker.frames_until_lost, code.tracker.frames_until_lost);
  EXPECT_EQ(file.tracker.max_prediction_gap_s, code.tracker.max_prediction_gap_s);
  EXPECT_EQ(file.tracker.max_velocity_mm_s, code.tracker.max_velocity_mm_s);
  EXPECT_EQ(file.tracker.max_velocity_rad_s, code.tracker.max_velocity_rad_s);
}

// cfg/*.cfg repeats the defaults for rqt_reconfigure.
TEST(LiveParameters, HaveTheSameDefaults) {
  const AcceptConfig accept = AcceptConfig::__getDefault__();
  const AcceptConfig accept_code = toConfig(AcceptOptions{});
  EXPECT_EQ(accept.min_similarity, accept_code.min_similarity);
  EXPECT_EQ(accept.min_inlier_fraction, accept_code.min_inlier_fraction);
  EXPECT_EQ(accept.max_condition_number, accept_code.max_condition_number);
  EXPECT_EQ(accept.max_jump_mm, accept_code.max_jump_mm);
  EXPECT_EQ(accept.max_jump_rad, accept_code.max_jump_rad);
  EXPECT_EQ(accept.max_disagreement_mm, accept_code.max_disagreement_mm);
  const SolverConfig solver = SolverConfig::__getDefault__();
  const SolverConfig solver_code = toConfig(RegistrarOptions{});
  EXPECT_EQ(solver.similarity, solver_code.similarity);
  EXPECT_EQ(solver.max_steps_per_frame, solver_code.max_steps_per_frame);
  EXPECT_EQ(solver.max_image_pixels, solver_code.max_image_pixels);
  EXPECT_EQ(solver.robust_weights, solver_code.robust_weights);
  EXPECT_EQ(solver.truncation_weights, solver_code.truncation_weights);
  const TrackingConfig tracking = TrackingConfig::__getDefault__();
  const TrackingConfig tracking_code = toConfig(TrackerOptions{});
  EXPECT_EQ(tracking.frames_until_lost, tracking_code.frames_until_lost);
  EXPECT_EQ(tracking.max_prediction_gap_s, tracking_code.max_prediction_gap_s);
  EXPECT_EQ(tracking.max_velocity_mm_s, tracking_code.max_velocity_mm_s);
  EXPECT_EQ(tracking.max_velocity_rad_s, tracking_code.max_velocity_rad_s);
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

}  // namespace
}  // namespace xray_registration

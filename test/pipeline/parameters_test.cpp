#include "xray_registration/pipeline/parameters.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <fstream>

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
image: {kind: inverted, find_metal: false, masks: {oblique: b.png},
  undistortion_map: all.yaml, undistortion_maps: {oblique: b.yaml}}
views: [ap, oblique]
sync: {tolerance: 0.5, allow_missing_view: true}
stamps: {max_ahead: 0.1, max_jump: 3, max_late: 2, frames_until_new: 5}
health: {hold_timeout: 0}
device: gpu
method: paper
mode: on_demand
frames: {ct: bone, fixed: room, allow_change: true}
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
  EXPECT_EQ(parameters.image.undistortion_map, "all.yaml");
  EXPECT_EQ(parameters.image.undistortion_maps.at("oblique"), "b.yaml");
  EXPECT_EQ(parameters.viewNames().size(), 2U);
  EXPECT_EQ(parameters.registrar.method, Method::kPaper);
  EXPECT_EQ(parameters.mode, Mode::kOnDemand);
  EXPECT_EQ(parameters.frames.fixed, "room");
  EXPECT_TRUE(parameters.frames.allow_change);
  EXPECT_EQ(parameters.stamps.max_ahead_s, 0.1);
  EXPECT_EQ(parameters.stamps.max_jump_s, 3.0);
  EXPECT_EQ(parameters.stamps.max_late_s, 2.0);
  EXPECT_EQ(parameters.stamps.frames_until_new, 5);
  EXPECT_EQ(parameters.health.hold_timeout_s, 0.0);
  ASSERT_TRUE(parameters.initial_pose);
  EXPECT_DOUBLE_EQ(parameters.initial_pose->translation().x(), 100.0);
  EXPECT_EQ(parameters.initial_pose_frame, "room");
  EXPECT_EQ(parameters.registrar.accept.min_similarity, 0.7);
  EXPECT_EQ(parameters.registrar.similarity, Similarity::kGainOffset);
  EXPECT_EQ(parameters.tracker.frames_until_lost, 2);
}

TEST(Parameters, WhatTheNumbersOfACtMeanIsRead) {
  const NodeParameters parameters = parse(
      "ct: {hu_slope: 50000, hu_intercept: -1000, padding: -2000, check_values: false, orientation: RAS, unit_mm: "
      "0.001}");
  EXPECT_EQ(parameters.ct.read.hu_slope, 50000.0);
  EXPECT_EQ(parameters.ct.read.hu_intercept, -1000.0);
  EXPECT_EQ(parameters.ct.read.padding, -2000.0);
  EXPECT_FALSE(parameters.ct.read.check_values);
  EXPECT_EQ(parameters.ct.read.orientation, "RAS");
  EXPECT_EQ(parameters.ct.read.unit_mm, 0.001);
  EXPECT_FALSE(parse("ct: {padding: ''}").ct.read.padding);
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
      {"{ct: {hu_slope: 0}}", {"ct/hu_slope", "0", "other than 0"}},
      {"{ct: {padding: much}}", {"ct/padding", "much", "a number"}},
      {"{ct: {orientation: RAX}}", {"ct/orientation", "RAX", "LPS"}},
      {"{ct: {unit_mm: -1}}", {"ct/unit_mm", "-1", "0 to"}},
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
      {"{views: [1ap]}", {"views", "1ap", "letter"}},
      {"{views: [_x]}", {"views", "_x", "letter"}},
      {"{views: [ap, 7]}", {"views", "7", "letter"}},
      {"{views: [ap//b]}", {"views", "ap//b"}},
      {"{views: [ap/]}", {"views", "ap/"}},
      {"views:\n  - [a]\n  - [b]", {"views", "[[a], [b]]", "list of names"}},
      {"{frames: {ct: ''}}", {"frames/ct"}},
      {"{frames: {ct: /ct}}", {"frames/ct", "/ct"}},
      {"{frames: {fixed: ct}}", {"frames/fixed", "ct"}},
      {"{accept: {min_similarity: 2}}", {"accept/min_similarity", "2"}},
      {"{solver: {max_steps_per_frame: 0}}", {"solver/max_steps_per_frame", "0"}},
      {"{tracking: {frames_until_lost: -1}}", {"tracking/frames_until_lost", "-1"}},
      {"{stamps: {max_ahead: -1}}", {"stamps/max_ahead", "-1", "0 to 60"}},
      {"{stamps: {max_jump: long}}", {"stamps/max_jump", "long", "number"}},
      {"{stamps: {max_late: 0}}", {"stamps/max_late", "0", "0.1 to 3600"}},
      {"{stamps: {frames_until_new: 1}}", {"stamps/frames_until_new", "1", "2 to 1000"}},
      {"{frames: {allow_change: 2}}", {"frames/allow_change", "2", "true or false"}},
      {"{health: {hold_timeout: .nan}}", {"health/hold_timeout", "nan"}},
      {"{health: {max_dropped: 2}}", {"health/max_dropped", "2", "0 to 1"}},
      {"{health: {pose_age_warn: 7}}", {"health/pose_age_warn", "'7'", "health/pose_age_error", "'5'"}},
      {"{health: {image_age_error: 0.5}}", {"health/image_age_warn", "'1'", "health/image_age_error", "'0.5'"}},
      {"{initial_pose: {position: [0, 0, 1], orientation: [0, 0, 0, 1], frame_id: ct}}",
       {"initial_pose/frame_id", "'ct'", "frames/ct"}},
      {"{sync: {tolerance: -0.1}}", {"sync/tolerance", "-0.1"}},
      {"{accept: {min_similarty: 0.5}}", {"accept/min_similarty", "not known", "min_similarity"}},
      {"{views: [ap], image: {masks: {lateral: x.png}}}", {"image/masks/lateral", "not known", "ap"}},
      {"{views: [ap], image: {undistortion_maps: {lateral: x.yaml}}}",
       {"image/undistortion_maps/lateral", "not known", "ap"}},
      {"{image: {undistortion_map: [a]}}", {"image/undistortion_map", "[a]", "a text"}},
      {"{initial_pose: {position: [0, 0, 1], orientation: [0, 0, 0, 0]}}", {"initial_pose", "orientation", "length"}},
      {"{initial_pose: {position: [0, 0], orientation: [0, 0, 0, 1]}}", {"initial_pose", "position"}},
      {"{initial_pose: [0, 0, 1]}", {"initial_pose", "position"}},
      {"{initial_pose: {T_camera_ct_mm: [1, 2, 3]}}", {"initial_pose", "T_camera_ct_mm", "16 numbers, not 3"}},
      {"{initial_pose: {T_camera_ct_mm: [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}}", {"initial_pose", "not a rigid"}},
      {"{initial_pose: {T_camera_ct_mm: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1], position: [0, 0, 1]}}",
       {"initial_pose", "beside 'position'"}},
      {"{initial_pose: {position: [0, 0, .inf], orientation: [0, 0, 0, 1]}}", {"initial_pose"}},
      {"{initial_pose: {position: [0, 0, 1], orientation: [0, 0, 0, 1], frame: room}}",
       {"initial_pose/frame", "room", "frame_id, orientation, position"}},
      {"{initial_pose: {position: [0, 0, 1], orientation: [0, 0, 0, 1], frame_id: [a, b]}}",
       {"initial_pose/frame_id", "[a, b]", "a text"}},
      {"initial_pose:\n  position:\n    - 1\n    - 2\n", {"initial_pose", "{position: [1, 2]}", "orientation"}},
      {"{initial_pose: 'here\n\nthere'}", {"initial_pose", "here", "position"}},
      {"{accept: {[min_similarity]: 1}}", {"accept/[min_similarity]", "not known"}},
      {"{drr_encoding: rgb8}", {"drr_encoding", "rgb8", "mono8", "32FC1"}},
      {"{device: ''}", {"device"}},
  };
  for (const Case& one : cases) {
    const std::string reason = reasonOf(one.yaml);
    for (const char* word : one.words) EXPECT_NE(reason.find(word), std::string::npos) << one.yaml << " → " << reason;
    EXPECT_EQ(reason.find('\n'), std::string::npos) << one.yaml << " → " << reason;
  }
}

TEST(Parameters, ViewsAreNamesOfTopics) {
  const std::vector<std::string> views = {"ap", "a1_b", "carm/ap", "/carm/2"};
  EXPECT_EQ(parse("{views: [ap, a1_b, carm/ap, /carm/2]}").views, views);
}

TEST(Parameters, MessagesShowNoOrdersToATerminal) {
  const std::string reason = reasonOf("{device: cpu, method: \"\\e[2Jfast\\nfine\"}");
  EXPECT_NE(reason.find("\\x1b[2Jfast fine"), std::string::npos) << reason;
}

// As a regular expression of the standard library's would end the process.
TEST(Parameters, LongNamesAreRefused) {
  const std::string name(300000, 'a');
  EXPECT_NE(reasonOf("{views: [" + name + "]}").find("views"), std::string::npos);
  EXPECT_NE(reasonOf("{bodies: [{name: " + name + ", ct: a.nii}]}").find("name"), std::string::npos);
}

TEST(Parameters, UnknownNamesBesideTheGroupsAreWarnedOf) {
  std::vector<std::string> warnings;
  parse("{methd: paper}", &warnings);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("methd"), std::string::npos);
}

TEST(Parameters, InitialPoseAsAMatrix) {
  const auto parameters = parse(
      "{initial_pose: {T_camera_ct_mm: [[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 700], [0, 0, 0, 1]], frame_id: ap}}");
  ASSERT_TRUE(parameters.initial_pose);
  EXPECT_TRUE(parameters.initial_pose->translation().isApprox(Eigen::Vector3d(5.0, 6.0, 700.0)));
  EXPECT_TRUE((parameters.initial_pose->linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_EQ(parameters.initial_pose_frame, "ap");
}

TEST(Parameters, NoneMeansNoInitialPose) { EXPECT_FALSE(parse("{initial_pose: none}").initial_pose); }

// Messages write values out, and this one holds itself.
TEST(Parameters, WhatGrowsWithoutEndIsRefused) {
  const std::string path = testing::TempDir() + "parameters_bomb_test.yaml";
  std::ofstream(path) << "a: &a [1, *a]\naccept: *a\n";
  EXPECT_THROW(loadParametersYaml(path), ParameterError);
}

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

}  // namespace
}  // namespace xray_registration

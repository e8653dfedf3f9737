#include "xray_registration/pipeline/body_parameters.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "xray_registration/pipeline/parameters.h"

namespace xray_registration {
namespace {

NodeParameters parse(const std::string& yaml, std::vector<std::string>* warnings = nullptr) {
  return parseParameters(YAML::Load(yaml), [&](LogLevel, const std::string& text) {
    if (warnings != nullptr) warnings->push_back(text);
  });
}

BodyParameters body(const std::string& keys, std::vector<std::string>* warnings = nullptr) {
  return parse("{ct: {mask: m.nii}, bodies: [{name: b, " + keys + "}]}", warnings).bodies.at(0);
}

std::string reasonOf(const std::string& yaml) {
  try {
    parse(yaml);
  } catch (const ParameterError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(BodyParameters, WithoutBodiesNothingChanges) {
  const NodeParameters parameters = parse("{ct: {mask: m.nii, label: 2}}");
  EXPECT_TRUE(parameters.bodies.empty());
  EXPECT_TRUE(parameters.ct.rest);
  EXPECT_TRUE(parameters.needsCt());
  EXPECT_TRUE(parse("{bodies: []}").bodies.empty());
  EXPECT_FALSE(parse("{ct: {rest: false}}").ct.rest);
}

TEST(BodyParameters, AreReadFromEverySource) {
  const NodeParameters parameters = parse(R"(
ct: {mask: m.seg.nrrd}
bodies:
  - {name: T12, label: 32}
  - {name: T11, labels: [33, 103, "T11 left"], frame: spine/t11}
  - {name: L1, label: vertebrae_L1, initial_pose: {position: [0, 0, 1], orientation: [0, 0, 0, 1]}}
  - {name: radius, ct: radius.nii.gz, max_rotation: 0.5, max_translation: 0.02}
  - {name: implant, mesh: femur.stl, attenuation: 0.8, max_rotation_rad: 0.4, max_translation_mm: 7})");
  ASSERT_EQ(parameters.bodies.size(), 5U);
  const auto& bodies = parameters.bodies;
  EXPECT_EQ(bodies[0].name, "T12");
  EXPECT_EQ(bodies[0].frame, "T12");
  EXPECT_EQ(bodies[0].labels, std::vector<int>{32});
  EXPECT_EQ(bodies[0].max_rotation_rad, 0.3);
  EXPECT_EQ(bodies[0].max_translation_mm, 10.0);
  EXPECT_FALSE(bodies[0].initial_pose);
  EXPECT_EQ(bodies[1].labels, (std::vector<int>{33, 103}));
  EXPECT_EQ(bodies[1].label_names, std::vector<std::string>{"T11 left"});
  EXPECT_EQ(bodies[1].frame, "spine/t11");
  EXPECT_EQ(bodies[2].label_names, std::vector<std::string>{"vertebrae_L1"});
  ASSERT_TRUE(bodies[2].initial_pose);
  EXPECT_DOUBLE_EQ(bodies[2].initial_pose->translation().z(), 1000.0);
  EXPECT_EQ(bodies[3].ct, "radius.nii.gz");
  EXPECT_EQ(bodies[3].max_rotation_rad, 0.5);
  EXPECT_EQ(bodies[3].max_translation_mm, 20.0);
  EXPECT_FALSE(bodies[3].isCutFromCt());
  EXPECT_EQ(bodies[4].mesh, "femur.stl");
  EXPECT_EQ(bodies[4].attenuation_per_mm, 0.8);
  EXPECT_EQ(bodies[4].max_rotation_rad, 0.4);
  EXPECT_EQ(bodies[4].max_translation_mm, 7.0);
  EXPECT_TRUE(parameters.needsCt());
  EXPECT_FALSE(parse("{bodies: [{name: a, mesh: a.stl}, {name: b, ct: b.nii}]}").needsCt());
}

TEST(BodyParameters, AQuotedNumberIsAName) {
  EXPECT_EQ(body("label: '32'").label_names, std::vector<std::string>{"32"});
}

TEST(BodyParameters, RangesInTheWrongUnitAreTakenForWhatTheyAre) {
  std::vector<std::string> warnings;
  const BodyParameters odd = body("label: 1, max_rotation: 12, max_translation: 8", &warnings);
  EXPECT_NEAR(odd.max_rotation_rad, 12.0 * M_PI / 180.0, 1e-12);
  EXPECT_DOUBLE_EQ(odd.max_translation_mm, 8.0);
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_NE(warnings[0].find("bodies[0]/max_rotation is 12, which is taken for degrees"), std::string::npos);
  EXPECT_NE(warnings[1].find("bodies[0]/max_translation is 8, which is taken for millimetres"), std::string::npos);
  warnings.clear();
  const BodyParameters right = body("label: 1, max_rotation: 3.1, max_translation: 0.5", &warnings);
  EXPECT_EQ(right.max_rotation_rad, 3.1);
  EXPECT_EQ(right.max_translation_mm, 500.0);
  EXPECT_TRUE(warnings.empty());
}

TEST(BodyParameters, RefusalsNameBodyParameterValueAndWhatIsAllowed) {
  struct Case {
    std::string bodies;
    std::vector<const char*> words;
  };
  const std::vector<Case> cases = {
      {"3", {"bodies", "3", "a list"}},
      {"[T12]", {"bodies[0]", "T12", "group"}},
      {"[{name: a, label: 1}, {label: 2}]", {"bodies[1]/name", "letter"}},
      {"[{name: a b, label: 1}]", {"bodies[0]/name", "a b", "letter"}},
      {"[{name: a/b, label: 1}]", {"bodies[0]/name", "a/b"}},
      {"[{name: 1a, label: 1}]", {"bodies[0]/name", "1a"}},
      {"[{name: ct, label: 1, frame: other}]", {"bodies[0]/name", "ct", "other name"}},
      {"[{name: a, label: 1}, {name: a, label: 2, frame: f}]", {"bodies[1]/name", "'a'", "bodies[0]"}},
      {"[{name: a, label: 1}, {name: b, label: 2, frame: a}]", {"bodies[1]/frame", "'a'", "bodies[0]"}},
      {"[{name: a, label: 1}, {name: b, labels: [2, 1]}]", {"bodies[1]/label", "'1'", "bodies[0]"}},
      {"[{name: a, labels: [x, x]}]", {"bodies[0]/label", "'x'"}},
      {"[{name: a, label: 1, frame: bone}]", {"bodies[0]/frame", "bone", "frames/ct"}},
      {"[{name: a, label: 1, frame: room}]", {"bodies[0]/frame", "room", "frames/fixed"}},
      {"[{name: a, label: 1, frame: /a}]", {"bodies[0]/frame", "/a", "leading"}},
      {"[{name: a}]", {"bodies[0]/label", "not given", "exactly one of"}},
      {"[{name: a, label: 1, mesh: a.stl}]", {"bodies[0]/label", "another source", "exactly one of"}},
      {"[{name: a, ct: a.nii, mesh: a.stl}]", {"bodies[0]/label", "exactly one of"}},
      {"[{name: a, label: 1, labels: [2]}]", {"bodies[0]/labels", "[2]", "either"}},
      {"[{name: a, label: 0}]", {"bodies[0]/label", "0", "1 to 65535"}},
      {"[{name: a, label: 1.5}]", {"bodies[0]/label", "1.5"}},
      {"[{name: a, label: -3}]", {"bodies[0]/label", "-3"}},
      {"[{name: a, labels: []}]", {"bodies[0]/labels", "at least one"}},
      {"[{name: a, labels: 4}]", {"bodies[0]/labels", "4", "a list"}},
      {"[{name: a, labels: [70000]}]", {"bodies[0]/labels", "70000"}},
      {"[{name: a, label: 1, attenuation: 0.2}]", {"bodies[0]/attenuation", "0.2", "only with mesh"}},
      {"[{name: a, mesh: a.stl, attenuation: 0}]", {"bodies[0]/attenuation", "0"}},
      {"[{name: a, label: 1, max_rotation: -0.1}]", {"bodies[0]/max_rotation", "-0.1"}},
      {"[{name: a, label: 1, max_rotation: 200}]", {"bodies[0]/max_rotation", "200"}},
      {"[{name: a, label: 1, max_translation: 600}]", {"bodies[0]/max_translation", "600"}},
      {"[{name: a, label: 1, max_translation: far}]", {"bodies[0]/max_translation", "far"}},
      {"[{name: a, label: 1, max_translation: 0.1, max_translation_mm: 5}]",
       {"bodies[0]/max_translation", "0.1", "either max_translation or max_translation_mm"}},
      {"[{name: a, label: 1, max_rotation: 0.1, max_rotation_rad: 0.1}]", {"bodies[0]/max_rotation", "either"}},
      {"[{name: a, label: 1, max_rotation_rad: 12}]", {"bodies[0]/max_rotation_rad", "12"}},
      {"[{name: a, label: 1, initial_pose: [1]}]", {"bodies[0]/initial_pose", "[1]", "position"}},
      {"[{name: a, label: 1, colour: red}]", {"bodies[0]/colour", "red", "not known", "max_rotation"}},
  };
  for (const Case& one : cases) {
    const std::string reason =
        reasonOf("{ct: {mask: m.nii}, frames: {ct: bone, fixed: room}, bodies: " + one.bodies + "}");
    for (const char* word : one.words) EXPECT_NE(reason.find(word), std::string::npos) << one.bodies << " → " << reason;
    EXPECT_EQ(reason.find('\n'), std::string::npos) << one.bodies << " → " << reason;
  }
}

TEST(BodyParameters, LabelsNeedAMask) {
  const std::string reason = reasonOf("{bodies: [{name: a, mesh: a.stl}, {name: b, label: T12}]}");
  for (const char* word : {"bodies[1]/label", "T12", "ct/mask"}) EXPECT_NE(reason.find(word), std::string::npos);
}

}  // namespace
}  // namespace xray_registration

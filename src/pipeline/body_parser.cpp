#include "body_parser.h"

#include <cmath>
#include <map>

#include "parameter_group.h"
#include "xray_registration/common/names.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/pipeline/pose_yaml.h"

namespace xray_registration {
namespace {

constexpr int kLargestLabel = 65535;
constexpr double kLongestRangeMm = 500.0;
// Nobody lets a body move by half a metre, or by less than a degree when it is written in degrees.
constexpr double kLongestRangeM = 0.5;
constexpr double kMmPerM = 1000.0;

constexpr char kLabelAllowed[] = "a whole number from 1 to 65535, or the name of a segment in ct/mask";
constexpr char kSourcesAllowed[] =
    "exactly one of label (or labels: cut out of ct/path by ct/mask), ct (a volume of its own), mesh (STL, PLY, VTK)";

std::string placeOf(std::size_t index) { return "bodies[" + std::to_string(index) + "]"; }

bool isNumber(const YAML::Node& node) {
  double unused = 0.0;
  return YAML::convert<double>::decode(node, unused);
}

void addLabel(const ParameterGroup& group, const std::string& key, const YAML::Node& node, BodyParameters* body) {
  if (!node.IsScalar() || node.Scalar().empty()) group.fail(key, shown(node), kLabelAllowed);
  // yaml-cpp marks a text in quotes so.
  const bool is_quoted = node.Tag() == "!";
  int label = 0;
  if (is_quoted || !isNumber(node)) {
    body->label_names.push_back(node.Scalar());
  } else if (YAML::convert<int>::decode(node, label) && label >= 1 && label <= kLargestLabel) {
    body->labels.push_back(label);
  } else {
    group.fail(key, shown(node), kLabelAllowed);
  }
}

void readLabels(ParameterGroup* group, BodyParameters* body) {
  const YAML::Node one = group->known("label");
  const YAML::Node several = group->known("labels");
  if (ParameterGroup::isGiven(one)) addLabel(*group, "label", one, body);
  if (!ParameterGroup::isGiven(several)) return;
  if (ParameterGroup::isGiven(one)) group->fail("labels", shown(several), "either label or labels");
  if (!several.IsSequence() || several.size() == 0) {
    group->fail("labels", shown(several), std::string("a list with at least one entry, each ") + kLabelAllowed);
  }
  for (const auto& label : several) addLabel(*group, "labels", label, body);
}

// A range in its ROS unit under `key`, or in the unit that `explicit_key` names. `factor`: from the one to the other.
struct Range {
  const char* key;
  const char* explicit_key;
  double largest_of_key;  // Above it, the value is meant in another unit.
  double factor;
  double factor_above;
  double largest;  // In the explicit key's unit.
  const char* taken_for;
};

void readRange(const Range& range, ParameterGroup* group, const std::string& place, const Logger& logger,
               double* value) {
  const YAML::Node given = group->known(range.key);
  const YAML::Node explicitly = group->known(range.explicit_key);
  if (ParameterGroup::isGiven(given) && ParameterGroup::isGiven(explicitly)) {
    group->fail(range.key, shown(given), std::string("either ") + range.key + " or " + range.explicit_key);
  }
  group->number(range.explicit_key, 0.0, range.largest, value);
  if (!ParameterGroup::isGiven(given)) return;
  double number = 0.0;
  group->number(range.key, 0.0, range.largest / range.factor_above, &number);
  if (number <= range.largest_of_key) {
    *value = number * range.factor;
    return;
  }
  *value = number * range.factor_above;
  log(logger, LogLevel::kWarning,
      "parameter " + place + "/" + range.key + " is " + shown(given) + ", which is taken for " + range.taken_for);
}

void readRanges(ParameterGroup* group, const std::string& place, const Logger& logger, BodyParameters* body) {
  constexpr double kDegree = M_PI / 180.0;
  const Range rotation = {
      "max_rotation", "max_rotation_rad", M_PI, 1.0, kDegree, M_PI, "degrees; the unit is rad (max_rotation_rad)"};
  const Range translation = {"max_translation",
                             "max_translation_mm",
                             kLongestRangeM,
                             kMmPerM,
                             1.0,
                             kLongestRangeMm,
                             "millimetres; the unit is metres, max_translation_mm is in millimetres"};
  readRange(rotation, group, place, logger, &body->max_rotation_rad);
  readRange(translation, group, place, logger, &body->max_translation_mm);
}

void readPose(ParameterGroup* group, BodyParameters* body) {
  const YAML::Node node = group->known("initial_pose");
  if (!ParameterGroup::isGiven(node) || (node.IsScalar() && node.Scalar() == "none")) return;
  try {
    body->initial_pose = poseFromYaml(node);
  } catch (const std::invalid_argument& error) {
    group->fail("initial_pose", shown(node), std::string(kPoseInYaml) + " (" + error.what() + ")");
  }
}

void checkSource(ParameterGroup* group, const BodyParameters& body) {
  const int sources =
      static_cast<int>(body.isCutFromCt()) + static_cast<int>(!body.ct.empty()) + static_cast<int>(!body.mesh.empty());
  if (sources != 1) {
    group->fail("label", sources == 0 ? "not given, nor ct, nor mesh" : "given beside another source", kSourcesAllowed);
  }
  const YAML::Node attenuation = group->known("attenuation");
  if (body.mesh.empty() && ParameterGroup::isGiven(attenuation)) {
    group->fail("attenuation", shown(attenuation), "only with mesh; a CT says what it attenuates");
  }
}

BodyParameters readBody(const YAML::Node& node, const std::string& place, const Logger& logger) {
  ParameterGroup group(place, node);
  BodyParameters body;
  group.words("name", &body.name);
  readLabels(&group, &body);
  group.words("ct", &body.ct);
  group.words("mesh", &body.mesh);
  checkSource(&group, body);
  group.number("attenuation", 1e-4, 100.0, &body.attenuation_per_mm);
  body.frame = body.name;
  group.words("frame", &body.frame);
  readRanges(&group, place, logger, &body);
  readPose(&group, &body);
  group.refuseUnknown();
  return body;
}

[[noreturn]] void fail(std::size_t index, const std::string& key, const std::string& value,
                       const std::string& allowed) {
  throw ParameterError("parameter " + placeOf(index) + "/" + key + " is '" + value + "'; allowed: " + allowed);
}

void checkName(std::size_t index, const std::string& name) {
  if (!isName(name)) {
    fail(index, "name", name, "a segment of a ROS name: a letter, then letters, digits and _");
  }
  // What tables and messages call the rest.
  if (name == "ct") fail(index, "name", name, "any other name; the CT itself is called so");
}

// Refuses what two bodies have in common.
class Taken {
 public:
  explicit Taken(std::string key) : key_(std::move(key)) {}

  void take(std::size_t index, const std::string& value) {
    const auto [at, is_new] = owners_.emplace(value, index);
    if (!is_new) fail(index, key_, value, "each only once, and " + placeOf(at->second) + " has it");
  }

 private:
  std::string key_;
  std::map<std::string, std::size_t> owners_;
};

void checkFrame(std::size_t index, const std::string& frame, const FrameParameters& frames) {
  if (frame.empty() || frame.front() == '/' || frame.find(' ') != std::string::npos) {
    fail(index, "frame", frame, "a tf2 frame, without a leading / and spaces");
  }
  if (frame == frames.ct) fail(index, "frame", frame, "not the CT's (frames/ct)");
  if (frame == frames.fixed) fail(index, "frame", frame, "not frames/fixed");
}

}  // namespace

std::vector<BodyParameters> readBodies(const YAML::Node& tree, const Logger& logger) {
  std::vector<BodyParameters> bodies;
  const YAML::Node list = ParameterGroup(tree, "").known("bodies");
  if (!ParameterGroup::isGiven(list)) return bodies;
  if (!list.IsSequence()) {
    throw ParameterError("parameter bodies is '" + shown(list) +
                         "'; allowed: a list of {name, label | labels | ct | mesh, …}");
  }
  for (std::size_t i = 0; i < list.size(); ++i) bodies.push_back(readBody(list[i], placeOf(i), logger));
  return bodies;
}

void validateBodies(const NodeParameters& parameters) {
  Taken names("name");
  Taken frames("frame");
  Taken labels("label");
  for (std::size_t i = 0; i < parameters.bodies.size(); ++i) {
    const BodyParameters& body = parameters.bodies[i];
    checkName(i, body.name);
    names.take(i, body.name);
    checkFrame(i, body.frame, parameters.frames);
    frames.take(i, body.frame);
    for (const int label : body.labels) labels.take(i, std::to_string(label));
    for (const std::string& label : body.label_names) labels.take(i, label);
    if (body.isCutFromCt() && parameters.ct.mask.empty()) {
      fail(i, "label", body.labels.empty() ? body.label_names.front() : std::to_string(body.labels.front()),
           "only with ct/mask, the label image that it stands in");
    }
  }
}

}  // namespace xray_registration

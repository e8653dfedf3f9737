#include "tools/common/session_bodies.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/common/command_line.h"
#include "xray_registration/common/names.h"
#include "xray_registration/geometry/angles.h"

namespace xray_registration::tools {
namespace {

// Amplitudes are of each axis; along all three at once a motion is longer by this.
const double kAllAxes = std::sqrt(3.0);

void requireName(const std::string& name, const std::string& option) {
  if (!isName(name)) {
    throw ArgumentError(option + ": '" + name + "' is no name of a body: a letter, then letters, digits and _");
  }
}

}  // namespace

std::vector<SessionBody> parseBodies(const std::string& text) {
  std::vector<SessionBody> bodies;
  for (const std::string& part : splitList(text)) {
    const std::vector<std::string> words = splitList(part, ':');
    if (words.size() != 2) throw ArgumentError("--labels: '" + part + "': expected NAME:LABEL, as T12:32");
    requireName(words[0], "--labels");
    const double label = parseNumber(words[1], "label of '" + part + "'");
    if (!(label >= 1.0 && label <= 65535.0) || label != std::floor(label)) {
      throw ArgumentError("--labels: '" + part + "': a label is a whole number from 1 to 65535");
    }
    auto body = std::find_if(bodies.begin(), bodies.end(), [&](const SessionBody& b) { return b.name == words[0]; });
    if (body == bodies.end()) body = bodies.insert(bodies.end(), {words[0], {}});
    body->labels.push_back(static_cast<int>(label));
  }
  return bodies;
}

SessionJoint parseJoint(const std::string& text) {
  const std::vector<std::string> words = splitList(text, ':');
  if (words.size() < 2 || words.size() > 3) {
    throw ArgumentError("--joint " + text + ": expected NAME:DEGREES, or NAME:DEGREES:X,Y,Z in mm");
  }
  SessionJoint joint;
  joint.body = words[0];
  joint.angle_deg = parseNumber(words[1], "angle of --joint");
  if (words.size() == 2) return joint;
  const std::vector<std::string> numbers = splitList(words[2]);
  if (numbers.size() != 3) throw ArgumentError("--joint " + text + ": a point has three coordinates");
  joint.pivot_ct_mm.emplace();
  for (int i = 0; i < 3; ++i) {
    (*joint.pivot_ct_mm)[i] = parseNumber(numbers[static_cast<std::size_t>(i)], "point of --joint");
  }
  return joint;
}

void SessionBodies::check() const {
  if (!(rotation_deg >= 0.0 && rotation_deg <= 90.0)) {
    throw ArgumentError("rotation of bodies (degrees) is " + std::to_string(rotation_deg) + ": allowed are 0 to 90");
  }
  if (!(translation_mm >= 0.0 && translation_mm <= 200.0)) {
    throw ArgumentError("shift of bodies (mm) is " + std::to_string(translation_mm) + ": allowed are 0 to 200");
  }
  if (!joint) return;
  if (!(std::abs(joint->angle_deg) <= 180.0)) {
    throw ArgumentError("angle of the joint (degrees) is " + std::to_string(joint->angle_deg) +
                        ": allowed are -180 to 180");
  }
  const auto is_it = [this](const SessionBody& body) { return body.name == joint->body; };
  if (std::none_of(bodies.begin(), bodies.end(), is_it)) {
    throw ArgumentError("--joint: no body is called '" + joint->body + "'; --labels names the bodies");
  }
}

MovingBodies::MovingBodies(const Volume& ct, const AttenuationModel& model, const LabelVolume& labels,
                           SessionBodies setup, double period_s, std::uint64_t seed)
    : setup_((setup.check(), std::move(setup))), period_s_(period_s) {
  std::vector<std::vector<int>> labels_of_bodies;
  for (const SessionBody& body : setup_.bodies) labels_of_bodies.push_back(body.labels);
  parts_ = cutBodies(ct, model, labels, labels_of_bodies);
  for (const AttenuationVolume& body : parts_.bodies) {
    centres_ct_mm_.push_back(anatomicalCentreCt(body));
    // Another motion for each, and none is the patient's.
    trajectories_.emplace_back(setup_.translation_mm / kAllAxes, setup_.rotation_deg / kAllAxes, period_s,
                               seed + 1000 * centres_ct_mm_.size());
  }
}

RigidTransform MovingBodies::motionCt(std::size_t body, double time_s) const {
  RigidTransform motion = trajectories_.at(body).motionCt(time_s, centres_ct_mm_[body]);
  if (!setup_.joint || setup_.bodies[body].name != setup_.joint->body) return motion;
  const double swing = 0.5 * (1.0 - std::cos(2.0 * M_PI * time_s / period_s_));
  Twist turn = Twist::Zero();
  turn[3] = swing * setup_.joint->angle_deg / kDegreesPerRadian;
  const Eigen::Vector3d pivot = setup_.joint->pivot_ct_mm.value_or(centres_ct_mm_[body]);
  return updatedPose(RigidTransform::Identity(), turn, pivot) * motion;
}

}  // namespace xray_registration::tools

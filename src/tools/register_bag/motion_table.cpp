#include "tools/register_bag/motion_table.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <locale>
#include <sstream>
#include <stdexcept>

#include "tools/common/command_line.h"
#include "xray_registration/geometry/angles.h"

namespace xray_registration::tools {
namespace {

// A micrometre is written to a tenth, and an angle to what moves a point 100 mm away by as much.
constexpr int kDigits = 4;
constexpr int kQuaternionDigits = 8;
constexpr int kStampDigits = 6;

const std::vector<std::string> kPose = {"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg", "qx", "qy", "qz", "qw"};
const std::vector<std::string> kRelative = {"cardan_x_deg", "cardan_y_deg", "cardan_z_deg",
                                            "shift_x_mm",   "shift_y_mm",   "shift_z_mm"};
const std::vector<std::string> kKnee = {"flexion_deg", "adduction_deg", "internal_rotation_deg",
                                        "lateral_mm",  "anterior_mm",   "distraction_mm"};

// Cells of one line.
class Line {
 public:
  Line() { text_.imbue(std::locale::classic()); }

  void word(const std::string& word) {
    if (!is_first_) text_ << ',';
    is_first_ = false;
    text_ << word;
  }

  void number(double value, int digits = kDigits) {
    std::ostringstream cell;
    cell.imbue(std::locale::classic());
    cell << std::fixed << std::setprecision(digits) << value;
    word(cell.str());
  }

  void point(const Eigen::Vector3d& point) {
    for (const double value : point) number(value);
  }

  void empty(std::size_t cells) {
    for (std::size_t i = 0; i < cells; ++i) word("");
  }

  void names(const std::string& prefix, const std::vector<std::string>& names) {
    const std::string start = prefix + "_";
    for (const std::string& name : names) word(start + name);
  }

  std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  bool is_first_ = true;
};

void addPose(const RigidTransform& pose, Line* line) {
  line->point(pose.translation());
  line->point(kDegreesPerRadian * vectorFromRotation(pose.linear()));
  Eigen::Quaterniond q(pose.linear());
  // q and -q are one rotation; a positive w keeps columns from jumping.
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  for (const double value : {q.x(), q.y(), q.z(), q.w()}) line->number(value, kQuaternionDigits);
}

void addRelative(const RigidTransform& T_other_body, const Eigen::Vector3d& centre_mm, Line* line) {
  addPose(T_other_body, line);
  const CardanAngles angles = cardanAngles(T_other_body.linear());
  line->point(kDegreesPerRadian * Eigen::Vector3d(angles.x_rad, angles.y_rad, angles.z_rad));
  line->point(T_other_body * centre_mm - centre_mm);
}

void addKnee(const KneeMotion& motion, Line* line) {
  for (const double angle : {motion.flexion_rad, motion.adduction_rad, motion.internal_rotation_rad}) {
    line->number(kDegreesPerRadian * angle);
  }
  for (const double shift : {motion.lateral_mm, motion.anterior_mm, motion.distraction_mm}) line->number(shift);
}

const TableBody* bodyNamed(const TableFrame& frame, const std::string& name) {
  const auto found = std::find_if(frame.bodies.begin(), frame.bodies.end(),
                                  [&name](const TableBody& body) { return body.name == name; });
  return found == frame.bodies.end() ? nullptr : &*found;
}

// The pose of what was accepted, else nothing.
const RigidTransform* acceptedPose(const TableFrame& frame, const std::string& name) {
  const TableBody* body = bodyNamed(frame, name);
  return body != nullptr && body->accepted ? &body->T_camera_body : nullptr;
}

void addAccepted(const TableBody* body, Line* line) {
  if (body == nullptr || !body->solved) {
    line->empty(1);
  } else {
    line->word(body->accepted ? "1" : "0");
  }
}

void addPoseOrNothing(const RigidTransform* pose, Line* line) {
  if (pose == nullptr) {
    line->empty(kPose.size());
  } else {
    addPose(*pose, line);
  }
}

void addRelativeOrNothing(const RigidTransform* other, const RigidTransform* body, const Eigen::Vector3d& centre_mm,
                          Line* line) {
  if (other == nullptr || body == nullptr) {
    line->empty(kPose.size() + kRelative.size());
  } else {
    addRelative(other->inverse() * *body, centre_mm, line);
  }
}

void requireBody(const std::string& name, const std::string& knee, const std::vector<TableBodySetup>& bodies) {
  if (std::any_of(bodies.begin(), bodies.end(), [&name](const TableBodySetup& body) { return body.name == name; })) {
    return;
  }
  throw ArgumentError("--knee " + knee + ": no body is called '" + name + "'");
}

}  // namespace

TableKnee parseKnee(const std::string& text, const std::vector<TableBodySetup>& bodies) {
  const std::vector<std::string> words = splitList(text);
  if (words.size() < 2 || words.size() > 3) {
    throw ArgumentError("--knee " + text + ": expected the names of two bodies, and left or right: femur,tibia,left");
  }
  TableKnee knee;
  knee.femur = words[0];
  knee.tibia = words[1];
  requireBody(knee.femur, text, bodies);
  requireBody(knee.tibia, text, bodies);
  if (knee.femur == knee.tibia) throw ArgumentError("--knee " + text + ": femur and tibia are the same body");
  if (words.size() == 3 && words[2] != "left" && words[2] != "right") {
    throw ArgumentError("--knee " + text + ": the side is left or right, not '" + words[2] + "'");
  }
  if (words.size() == 3 && words[2] == "left") knee.side = Side::kLeft;
  return knee;
}

std::string MotionTable::header() const {
  Line line;
  line.word("stamp_s");
  const auto add_pose = [&line](const std::string& name) {
    line.word(name + "_accepted");
    line.names(name, kPose);
  };
  if (setup_.has_ct) add_pose("ct");
  for (const TableBodySetup& body : setup_.bodies) add_pose(body.name);
  const auto add_relative = [&line](const std::string& body, const std::string& other) {
    line.names(body + "_in_" + other, kPose);
    line.names(body + "_in_" + other, kRelative);
  };
  for (std::size_t i = 0; i < setup_.bodies.size(); ++i) {
    if (setup_.has_ct) add_relative(setup_.bodies[i].name, "ct");
    for (std::size_t j = 0; j < i; ++j) add_relative(setup_.bodies[i].name, setup_.bodies[j].name);
  }
  if (setup_.knee) line.names("knee", kKnee);
  return line.text();
}

std::string MotionTable::row(const TableFrame& frame) const {
  Line line;
  line.number(frame.stamp_s, kStampDigits);
  const RigidTransform* ct = frame.accepted ? &frame.T_camera_ct : nullptr;
  if (setup_.has_ct) {
    line.word(frame.accepted ? "1" : "0");
    addPoseOrNothing(ct, &line);
  }
  for (const TableBodySetup& body : setup_.bodies) {
    addAccepted(bodyNamed(frame, body.name), &line);
    addPoseOrNothing(acceptedPose(frame, body.name), &line);
  }
  for (std::size_t i = 0; i < setup_.bodies.size(); ++i) {
    const TableBodySetup& body = setup_.bodies[i];
    const RigidTransform* pose = acceptedPose(frame, body.name);
    if (setup_.has_ct) addRelativeOrNothing(ct, pose, body.centre_mm, &line);
    for (std::size_t j = 0; j < i; ++j) {
      addRelativeOrNothing(acceptedPose(frame, setup_.bodies[j].name), pose, body.centre_mm, &line);
    }
  }
  if (!setup_.knee) return line.text();
  const TableKnee& knee = *setup_.knee;
  const RigidTransform* femur = acceptedPose(frame, knee.femur);
  const RigidTransform* tibia = acceptedPose(frame, knee.tibia);
  if (femur == nullptr || tibia == nullptr) {
    line.empty(kKnee.size());
  } else {
    addKnee(kneeMotion(jointPose(*femur, *tibia, knee.T_femur_anatomy, knee.T_tibia_anatomy), knee.side), &line);
  }
  return line.text();
}

void MotionTable::write(const std::string& path, const std::vector<TableFrame>& frames) const {
  std::ofstream file(path);
  file << header() << '\n';
  for (const TableFrame& frame : frames) file << row(frame) << '\n';
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path);
}

}  // namespace xray_registration::tools

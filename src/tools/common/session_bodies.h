#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/common/trajectory.h"
#include "xray_registration/volume/body_cut.h"

namespace xray_registration::tools {

/// A structure that moves on its own in a simulated session.
struct SessionBody {
  std::string name;
  std::vector<int> labels;
};

/// "T12:32,T11:33" → two bodies; a name that is repeated gets all its labels.
/// @throws ArgumentError for a name that ROS does not take, or a label outside 1…65535.
std::vector<SessionBody> parseBodies(const std::string& text);

/// A body that swings like a limb: about the CT's left-right axis, from 0 to `angle_deg` and back in a period. Positive
/// angles take what is above the axis to the front and what is below it to the back (a jaw opens, a hip is extended).
struct SessionJoint {
  std::string body;
  double angle_deg = 0.0;
  std::optional<Eigen::Vector3d> pivot_ct_mm;  ///< A point of the axis; not given: the body's centre.
};

/// "femur_right:30" or "femur_right:30:-98,27,-332" (mm, LPS).
/// @throws ArgumentError
SessionJoint parseJoint(const std::string& text);

/// How the bodies of a session move.
struct SessionBodies {
  std::vector<SessionBody> bodies;
  double rotation_deg = 0.0;    ///< Largest angle of each body against the rest, about its centre.
  double translation_mm = 0.0;  ///< Largest shift of its centre.
  std::optional<SessionJoint> joint;

  /// @throws ArgumentError naming the value that is out of range.
  void check() const;
};

/// A CT in parts that move smoothly. Thread-safe once made.
class MovingBodies {
 public:
  /// `period_s`, `seed`: as those of Trajectory.
  /// @throws VolumeError when a label selects nothing.
  MovingBodies(const Volume& ct, const AttenuationModel& model, const LabelVolume& labels, SessionBodies setup,
               double period_s, std::uint64_t seed);

  const CutCt& parts() const { return parts_; }

  /// In the CT, mm.
  const Eigen::Vector3d& centreCt(std::size_t body) const { return centres_ct_mm_.at(body); }

  /// Maps points of a body where the CT has it to where they are in the CT's frame at `time_s`.
  RigidTransform motionCt(std::size_t body, double time_s) const;

 private:
  SessionBodies setup_;
  CutCt parts_;
  std::vector<Eigen::Vector3d> centres_ct_mm_;
  std::vector<Trajectory> trajectories_;
  double period_s_;
};

}  // namespace xray_registration::tools

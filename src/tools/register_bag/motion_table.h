#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "xray_registration/geometry/joint_angles.h"
#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration::tools {

/// One body in one frame.
struct TableBody {
  std::string name;
  RigidTransform T_camera_body = RigidTransform::Identity();
  bool accepted = false;
  bool solved = false;  ///< There is a pose, accepted or not.
};

/// One frame of a session; poses in the first view's camera, mm.
struct TableFrame {
  double stamp_s = 0.0;
  RigidTransform T_camera_ct = RigidTransform::Identity();
  bool accepted = false;  ///< T_camera_ct is.
  std::vector<TableBody> bodies;
};

/// What stands in the table about a body, the same for all frames.
struct TableBodySetup {
  std::string name;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< In the body's frame: the point whose shifts are written.
};

/// Columns of a knee. The anatomical frames are those of kneeMotion; for bodies of a CT anyone's is anatomyInCt().
struct TableKnee {
  std::string femur;
  std::string tibia;
  Side side = Side::kRight;
  RigidTransform T_femur_anatomy = RigidTransform::Identity();
  RigidTransform T_tibia_anatomy = RigidTransform::Identity();
};

struct TableSetup {
  bool has_ct = true;  ///< Else all bodies have volumes of their own, and T_camera_ct is not looked at.
  std::vector<TableBodySetup> bodies;
  std::optional<TableKnee> knee;
};

/// "femur,tibia" or "femur,tibia,left": names of two of `bodies`, and the side (right when left out).
/// @throws ArgumentError naming --knee and what is wrong.
TableKnee parseKnee(const std::string& text, const std::vector<TableBodySetup>& bodies);

/// The motion of a session as comma-separated values, for spreadsheets: one line of column names, one line per frame.
/// Lengths in mm, angles in degrees, a point for decimals. Columns (docs/formats.md):
///   stamp_s, then for the CT, and for each body, <name>_accepted and its pose in the camera: <name>_x_mm, y, z,
///   <name>_rx_deg, ry, rz (rotation vector), <name>_qx, qy, qz, qw;
///   then of each body against the CT and against each body before it <body>_in_<other>_…: the same, and
///   …_cardan_x_deg, y, z (cardanAngles), and …_shift_x_mm, y, z, where the body's centre lies off the place that it
///   has when both frames coincide, as in the CT; then of the knee flexion, adduction, internal rotation, and the
///   tibia's shifts (kneeMotion).
/// Cells of what was refused are empty; <name>_accepted is 1, 0, or empty where nothing was found.
class MotionTable {
 public:
  explicit MotionTable(TableSetup setup) : setup_(std::move(setup)) {}

  std::string header() const;

  /// Bodies are found by their names; one that is missing gets empty cells.
  std::string row(const TableFrame& frame) const;

  /// @throws std::runtime_error naming the file when it cannot be written.
  void write(const std::string& path, const std::vector<TableFrame>& frames) const;

 private:
  TableSetup setup_;
};

}  // namespace xray_registration::tools

#include "image/dicom/vendor_camera.h"

#include <Eigen/LU>
#include <cmath>

#include "image/dicom/detector.h"
#include "xray_registration/geometry/angles.h"

namespace xray_registration::dicom {
namespace {

constexpr double kSquare = 1e-3;  // Skew, and difference of the focal lengths, as a share of them.

/// Rows of the rotation with their lengths: of the third, then of what is at right angles to it in the others.
struct Cut {
  double fu_mm = 0.0, fv_mm = 0.0;
  double skew_mm = 0.0;
  Eigen::Vector2d principal_mm;
  Eigen::Matrix3d axes;    ///< Rows: directions of columns, rows and beam; a mirrored picture's are left-handed.
  Eigen::Vector3d source;  ///< Of the beam, mm.
};

Cut cutOf(Eigen::Matrix<double, 3, 4> projection) {
  projection /= projection.block<1, 3>(2, 0).norm();
  const Eigen::Matrix3d m = projection.leftCols<3>();
  Cut cut;
  cut.source = -m.inverse() * projection.col(3);
  const Eigen::Vector3d u = m.row(0), v = m.row(1), beam = m.row(2);
  cut.principal_mm = {u.dot(beam), v.dot(beam)};
  const Eigen::Vector3d v_across = v - cut.principal_mm.y() * beam;
  cut.fv_mm = v_across.norm();
  const Eigen::Vector3d rows = v_across / cut.fv_mm;
  const Eigen::Vector3d u_across = u - cut.principal_mm.x() * beam;
  cut.skew_mm = u_across.dot(rows);
  const Eigen::Vector3d columns = u_across - cut.skew_mm * rows;
  cut.fu_mm = columns.norm();
  cut.axes.row(0) = columns / cut.fu_mm;
  cut.axes.row(1) = rows;
  cut.axes.row(2) = beam;
  return cut;
}

bool isDetectorAtRightAngles(const Cut& cut) {
  return std::isfinite(cut.fu_mm) && cut.fu_mm > 0.0 && std::abs(cut.skew_mm) < kSquare * cut.fu_mm &&
         std::abs(cut.fv_mm / cut.fu_mm - 1.0) < kSquare && cut.source.allFinite();
}

}  // namespace

std::optional<DicomGeometry> vendorGeometry(const DicomHeader& header, const DicomFrame& frame,
                                            const GivenGeometry& given) {
  const Cut cut = cutOf(frame.vendor->detector_from_patient);
  DicomGeometry geometry;
  geometry.pixel_mm = pixelSize(header, frame, given, &geometry.warnings);
  if (!isDetectorAtRightAngles(cut) || !geometry.pixel_mm.value) return std::nullopt;
  const std::string& source = frame.vendor->source;
  const bool mirrored = cut.axes.determinant() < 0.0;
  const RowColumn& pixel_mm = *geometry.pixel_mm.value;
  geometry.source_detector_mm = {given.source_detector_mm.value_or(cut.fu_mm),
                                 given.source_detector_mm ? "--source-detector-mm" : source};
  geometry.principal_point_px = {
      Eigen::Vector2d(cut.principal_mm.x() / pixel_mm[1], cut.principal_mm.y() / pixel_mm[0]), source};
  if (given.principal_point_px) geometry.principal_point_px = {given.principal_point_px, "--principal-point-px"};
  geometry.mirrored = {mirrored, source};
  // What angles of a C-arm would be.
  const Eigen::Vector3d beam = cut.axes.row(2);
  geometry.primary_deg = {std::atan2(beam.x(), -beam.y()) * kDegreesPerRadian, source};
  geometry.secondary_deg = {std::asin(std::max(-1.0, std::min(1.0, beam.z()))) * kDegreesPerRadian, source};

  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = cut.axes;
  if (mirrored) pose.linear().row(0) = -pose.linear().row(0);
  pose.translation() = -(pose.linear() * cut.source);
  geometry.T_camera_isocentre = pose;
  geometry.source_isocentre_mm = {pose.translation().z(), source};

  XrayCamera camera;
  camera.width = header.width;
  camera.height = header.height;
  camera.fx = *geometry.source_detector_mm.value / pixel_mm[1];
  camera.fy = *geometry.source_detector_mm.value / pixel_mm[0];
  const Eigen::Vector2d& point = *geometry.principal_point_px.value;
  camera.cx = mirrored ? header.width - 1.0 - point.x() : point.x();
  camera.cy = point.y();
  if (*camera.problem() != '\0' || !pose.matrix().allFinite()) return std::nullopt;
  geometry.camera = camera;
  return geometry;
}

}  // namespace xray_registration::dicom

#include <cmath>
#include <cstdio>

#include "image/dicom/detector.h"
#include "image/dicom/positioner.h"
#include "image/dicom/vendor_camera.h"
#include "xray_registration/image/xray_dicom_geometry.h"

namespace xray_registration {
namespace {

constexpr double kSameDistance = 0.01;     // Share by which two statements of one distance may differ.
constexpr double kStraightBeam_deg = 0.1;  // Beyond, the detector is tilted, which changes where its normal meets it.

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

Stated<double> stated(const std::optional<double>& given, const char* option, const std::optional<double>& said,
                      const char* attribute) {
  if (given) return {given, option};
  if (said) return {said, attribute};
  return {};
}

/// The distances, each also from the other and the magnification.
void setDistances(const DicomFrame& frame, const GivenGeometry& given, DicomGeometry* geometry) {
  Stated<double>& detector = geometry->source_detector_mm;
  Stated<double>& isocentre = geometry->source_isocentre_mm;
  detector = stated(given.source_detector_mm, "--source-detector-mm", frame.source_detector_mm,
                    "DistanceSourceToDetector (0018,1110)");
  isocentre = stated(given.source_isocentre_mm, "--source-patient-mm", frame.source_isocentre_mm,
                     "DistanceSourceToPatient (0018,1111)");
  if (!frame.magnification) return;
  const double magnification = *frame.magnification;
  if (detector.value && isocentre.value) {
    if (std::abs(*detector.value / *isocentre.value / magnification - 1.0) < kSameDistance) return;
    geometry->warnings.push_back("the magnification (0018,1114) is " + number(magnification) +
                                 ", but the distances make it " + number(*detector.value / *isocentre.value) +
                                 "; the distances are used");
  } else if (isocentre.value) {
    detector = {*isocentre.value * magnification, isocentre.source + " times the magnification (0018,1114)", true};
  } else if (detector.value) {
    isocentre = {*detector.value / magnification, detector.source + " over the magnification (0018,1114)", true};
  }
}

/// Roughly, from the words for a radiograph: on which side of the patient the detector is.
std::optional<double> primaryOfView(const std::string& view_position) {
  if (view_position == "PA") return 0.0;
  if (view_position == "AP") return 180.0;
  if (view_position == "LL") return 90.0;
  if (view_position == "RL") return -90.0;
  return std::nullopt;
}

void setAngles(const DicomFrame& frame, const GivenGeometry& given, DicomGeometry* geometry) {
  geometry->primary_deg =
      stated(given.primary_deg, "--primary-deg", frame.primary_deg, "PositionerPrimaryAngle (0018,1510)");
  geometry->secondary_deg =
      stated(given.secondary_deg, "--secondary-deg", frame.secondary_deg, "PositionerSecondaryAngle (0018,1511)");
  if (geometry->primary_deg.value || geometry->secondary_deg.value) return;
  // Without the words for its axes such a picture may have either side on the left.
  const auto primary = primaryOfView(frame.view_position);
  if (!primary || frame.patient_orientation.size() != 2) return;
  geometry->primary_deg = {primary, "ViewPosition (0018,5101)", true};
  geometry->secondary_deg = {0.0, "ViewPosition (0018,5101)", true};
}

void refuseTilt(const DicomFrame& frame, const GivenGeometry& given, DicomGeometry* geometry) {
  const double tilt = std::hypot(frame.detector_primary_deg.value_or(0.0), frame.detector_secondary_deg.value_or(0.0));
  if (tilt < kStraightBeam_deg || given.principal_point_px) return;
  geometry->principal_point_px = {};
  geometry->missing.push_back({"where the detector's normal from the source meets it: the detector is tilted by " +
                                   number(tilt) + " degrees, DetectorPrimaryAngle (0018,1530)",
                               "--principal-point-px"});
}

void nameWhatIsMissing(DicomGeometry* geometry) {
  auto& missing = geometry->missing;
  if (!geometry->source_detector_mm.value) {
    missing.push_back(
        {"distance from source to detector, DistanceSourceToDetector (0018,1110)", "--source-detector-mm"});
  }
  if (!geometry->pixel_mm.value) {
    missing.push_back({"size of a pixel on the detector, ImagerPixelSpacing (0018,1164)", "--pixel-mm"});
  }
  if (!geometry->source_isocentre_mm.value) {
    missing.push_back(
        {"distance from source to isocentre, DistanceSourceToPatient (0018,1111)", "--source-patient-mm", true});
  }
  if (!geometry->primary_deg.value) {
    missing.push_back({"positioner angle, PositionerPrimaryAngle (0018,1510)", "--primary-deg", true});
  }
  if (!geometry->secondary_deg.value) {
    missing.push_back({"positioner angle, PositionerSecondaryAngle (0018,1511)", "--secondary-deg", true});
  }
}

/// Columns, rows and beam of the stored picture, and what they were taken from.
PositionerAxes axesOf(const DicomFrame& frame, DicomGeometry* geometry, std::string* source) {
  const PositionerAxes detector = positionerAxes(*geometry->primary_deg.value, *geometry->secondary_deg.value);
  PositionerAxes by_field =
      dicom::storedAxes(detector, frame.field_rotation_deg.value_or(0.0), frame.field_flipped.value_or(false));
  *source = frame.field_flipped ? "FieldOfViewRotation and HorizontalFlip (0018,7032), (0018,7034)"
                                : "as seen from the detector, which is usual";
  const auto by_words = dicom::axesAlong(detector, frame.patient_orientation);
  if (!by_words) {
    const auto& words = frame.patient_orientation;
    if (words.size() == 2 && !words[0].empty() && !words[1].empty()) {
      geometry->warnings.push_back("PatientOrientation (0020,0020), " + words[0] + " and " + words[1] +
                                   ", does not fit the positioner's angles; it is not used");
    }
    return by_field;
  }
  *source = "PatientOrientation (0020,0020)";
  const bool differ = by_words->columns.dot(by_field.columns) < 0.5 || by_words->rows.dot(by_field.rows) < 0.5;
  if (differ && frame.field_flipped) {
    geometry->warnings.emplace_back(
        "PatientOrientation (0020,0020) contradicts FieldOfViewRotation and HorizontalFlip (0018,7032), (0018,7034); "
        "PatientOrientation is used");
  }
  return *by_words;
}

bool isMirrored(const PositionerAxes& axes) { return axes.columns.cross(axes.rows).dot(axes.beam) < 0.0; }

void setPose(const DicomFrame& frame, const GivenGeometry& given, DicomGeometry* geometry) {
  if (!geometry->primary_deg.value || !geometry->secondary_deg.value) {
    geometry->mirrored = {given.mirrored.value_or(false), given.mirrored ? "--mirrored" : "not known: left as it is",
                          !given.mirrored};
    return;
  }
  std::string source;
  PositionerAxes axes = axesOf(frame, geometry, &source);
  if (given.mirrored && *given.mirrored != isMirrored(axes)) axes.columns = -axes.columns;
  geometry->mirrored = {isMirrored(axes), given.mirrored ? "--mirrored" : source};
  if (!geometry->source_isocentre_mm.value) return;
  RigidTransform pose = RigidTransform::Identity();
  Eigen::Matrix3d R_camera_patient;
  R_camera_patient.row(0) = *geometry->mirrored.value ? -axes.columns : axes.columns;
  R_camera_patient.row(1) = axes.rows;
  R_camera_patient.row(2) = axes.beam;
  pose.linear() = R_camera_patient;
  pose.translation() = Eigen::Vector3d(0.0, 0.0, *geometry->source_isocentre_mm.value);
  geometry->T_camera_isocentre = pose;
}

void setCamera(const DicomHeader& header, DicomGeometry* geometry) {
  if (!geometry->source_detector_mm.value || !geometry->pixel_mm.value || !geometry->principal_point_px.value) return;
  XrayCamera camera;
  camera.width = header.width;
  camera.height = header.height;
  camera.fx = *geometry->source_detector_mm.value / (*geometry->pixel_mm.value)[1];
  camera.fy = *geometry->source_detector_mm.value / (*geometry->pixel_mm.value)[0];
  const Eigen::Vector2d& point = *geometry->principal_point_px.value;
  camera.cx = *geometry->mirrored.value ? header.width - 1.0 - point.x() : point.x();
  camera.cy = point.y();
  const std::string problem = camera.problem();
  if (problem.empty()) {
    geometry->camera = camera;
  } else {
    geometry->missing.push_back(
        {"a camera that can be: with what is stated " + problem, "--source-detector-mm, --pixel-mm"});
  }
}

}  // namespace

DicomGeometry dicomGeometry(const DicomHeader& header, const DicomFrame& frame, const GivenGeometry& given) {
  DicomGeometry geometry;
  if (frame.vendor) {
    if (auto vendors = dicom::vendorGeometry(header, frame, given)) return *vendors;
    geometry.warnings.push_back(frame.vendor->source + " is no projection that the pixels fit to; it is not used");
  }
  setDistances(frame, given, &geometry);
  setAngles(frame, given, &geometry);
  geometry.pixel_mm = dicom::pixelSize(header, frame, given, &geometry.warnings);
  geometry.principal_point_px = dicom::principalPoint(header, frame, geometry.pixel_mm, given);
  refuseTilt(frame, given, &geometry);
  nameWhatIsMissing(&geometry);
  setPose(frame, given, &geometry);
  setCamera(header, &geometry);
  const auto& detector = geometry.source_detector_mm.value;
  const auto& isocentre = geometry.source_isocentre_mm.value;
  if (detector && isocentre && *isocentre >= *detector) {
    geometry.warnings.push_back("the isocentre, " + number(*isocentre) +
                                " mm from the source, lies behind the detector, " + number(*detector) +
                                " mm; one of them is wrong");
  }
  return geometry;
}

}  // namespace xray_registration

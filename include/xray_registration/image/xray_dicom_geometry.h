#pragma once

#include <optional>
#include <string>
#include <vector>

#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/xray_dicom.h"

namespace xray_registration {

/// What a person says; wins over what the file says.
struct GivenGeometry {
  std::optional<double> source_detector_mm;
  std::optional<double> source_isocentre_mm;
  std::optional<RowColumn> pixel_mm;                  ///< Of a pixel where the detector is.
  std::optional<Eigen::Vector2d> principal_point_px;  ///< Column and row of the stored picture; integers are centres.
  std::optional<double> primary_deg;
  std::optional<double> secondary_deg;
  std::optional<bool> mirrored;
};

/// A part of the geometry, and where it comes from.
template <typename T>
struct Stated {
  std::optional<T> value;
  std::string source;     ///< The attribute or option, in words.
  bool estimate = false;  ///< Good to a percent or worse.
};

/// Something that neither the file nor a person says.
struct MissingGeometry {
  std::string what;       ///< With the attribute that would hold it.
  std::string remedy;     ///< The option of dicom_to_bag that gives it.
  bool for_pose = false;  ///< Only the first pose needs it.
};

/// How the X-ray of one frame was taken.
///
/// Radiographs are often stored as seen from the detector, which no pinhole camera with its axes along columns, rows
/// and beam sees: such a picture is `mirrored`, and the camera describes it with the order of its columns reversed.
struct DicomGeometry {
  Stated<double> source_detector_mm;
  Stated<double> source_isocentre_mm;
  Stated<RowColumn> pixel_mm;
  Stated<Eigen::Vector2d> principal_point_px;  ///< Of the stored picture.
  Stated<double> primary_deg;
  Stated<double> secondary_deg;
  Stated<bool> mirrored;  ///< Always has a value.
  std::optional<XrayCamera> camera;
  /// Maps points of the patient (LPS directions, mm) from the isocentre on into the camera.
  std::optional<RigidTransform> T_camera_isocentre;
  std::vector<MissingGeometry> missing;
  std::vector<std::string> warnings;  ///< What contradicts itself, or is only an estimate.
};

/// What can be said of a frame of `header`. Never throws: what is missing is named, and then there is no camera or no
/// pose. docs/tutorial_dicom.md has the signs of the angles.
DicomGeometry dicomGeometry(const DicomHeader& header, const DicomFrame& frame, const GivenGeometry& given = {});

/// Reverses the order of the columns, in place.
template <typename T>
void mirrorColumns(Image<T>* image) {
  for (int v = 0; v < image->height; ++v) {
    for (int u = 0; u < image->width / 2; ++u) std::swap(image->at(u, v), image->at(image->width - 1 - u, v));
  }
}

/// Where a C-arm stands: directions in the patient's axes (LPS).
struct PositionerAxes {
  Eigen::Vector3d beam;     ///< From the source to the detector.
  Eigen::Vector3d columns;  ///< To the right of the stored picture, before its rotation and flip.
  Eigen::Vector3d rows;     ///< Down in it.
};

/// DICOM PS3.3 C.8.7.5.1.2: at 0, 0 the patient faces the detector. The primary angle is the detector's longitude about
/// the patient's long axis, towards the left side (LAO) above zero; the secondary one its latitude, towards the head
/// above zero. The picture has the patient's left on its right and the head on top there, and turns with the detector.
PositionerAxes positionerAxes(double primary_deg, double secondary_deg);

}  // namespace xray_registration

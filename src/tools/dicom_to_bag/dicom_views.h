#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/dicom_to_bag/dicom_runs.h"
#include "xray_registration/image/xray_dicom_geometry.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration::tools {

/// How a run goes into the bag.
struct DicomView {
  const DicomRun* run = nullptr;
  PixelMeaning meaning;  ///< As the file, or the person, has it.
  ImageKind kind = ImageKind::kTransmission;
  std::vector<DicomGeometry> geometries;  ///< One for each picture.
  MaskImage mask;                         ///< As the pictures in the bag; empty: nothing is covered.

  const std::string& name() const { return run->view; }
  const DicomGeometry& geometry() const { return geometries.front(); }
};

/// @param kind  What a person says that the stored values are.
DicomView dicomView(const DicomRun& run, const GivenGeometry& given, const std::optional<ImageKind>& kind);

/// The first picture that cannot be written for what its geometry lacks; none when all can. Of a run with functional
/// groups each picture has its own.
std::optional<std::size_t> incompletePicture(const DicomView& view);

/// The CT in the camera of a picture; none when the geometry has no pose.
std::optional<RigidTransform> cameraFromCt(const DicomGeometry& geometry, const Eigen::Vector3d& isocentre_ct_mm);

/// "transmission", as the parameter image/kind has it.
const char* nameOf(ImageKind kind);

}  // namespace xray_registration::tools

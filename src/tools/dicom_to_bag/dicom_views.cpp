#include "tools/dicom_to_bag/dicom_views.h"

#include <algorithm>

namespace xray_registration::tools {

const char* nameOf(ImageKind kind) {
  switch (kind) {
    case ImageKind::kAttenuation:
      return "attenuation";
    case ImageKind::kInverted:
      return "inverted";
    default:
      return "transmission";
  }
}

DicomView dicomView(const DicomRun& run, const GivenGeometry& given, const std::optional<ImageKind>& kind) {
  DicomView view;
  view.run = &run;
  view.meaning = pixelMeaning(run.header());
  view.kind = view.meaning.is_attenuation ? ImageKind::kAttenuation : ImageKind::kTransmission;
  if (kind) {
    view.kind = *kind;
    view.meaning = {*kind == ImageKind::kAttenuation, false, false, "--kind, the stored values as they are"};
  }
  for (const DicomPicture& picture : run.pictures) {
    view.geometries.push_back(dicomGeometry(run.files[picture.file].header(), run.frame(picture), given));
  }
  view.mask = shutterMask(run.header(), run.frame(run.pictures.front()));
  if (*view.geometry().mirrored.value) mirrorColumns(&view.mask);
  return view;
}

std::optional<std::size_t> incompletePicture(const DicomView& view) {
  const auto lacks_something = [](const DicomGeometry& geometry) {
    return std::any_of(geometry.missing.begin(), geometry.missing.end(),
                       [](const MissingGeometry& one) { return !one.for_pose; });
  };
  const auto found = std::find_if(view.geometries.begin(), view.geometries.end(), lacks_something);
  if (found == view.geometries.end()) return std::nullopt;
  return static_cast<std::size_t>(found - view.geometries.begin());
}

std::optional<RigidTransform> cameraFromCt(const DicomGeometry& geometry, const Eigen::Vector3d& isocentre_ct_mm) {
  if (!geometry.T_camera_isocentre) return std::nullopt;
  return RigidTransform(*geometry.T_camera_isocentre * Eigen::Translation3d(-isocentre_ct_mm));
}

}  // namespace xray_registration::tools

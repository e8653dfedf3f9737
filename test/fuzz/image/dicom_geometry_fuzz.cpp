// The attributes of a DICOM X-ray to its geometry. An input is a list of attributes: which one of those that are looked
// at, what kind of value, the value.
#include <cmath>

#include "image/dicom/data_set.h"
#include "image/dicom/facts.h"
#include "image/dicom/tags.h"
#include "test/fuzz/fuzz_target.h"
#include "xray_registration/image/xray_dicom.h"
#include "xray_registration/image/xray_dicom_geometry.h"

namespace xray_registration::fuzz {
namespace {

constexpr int kDeepest = 3;

constexpr dicom::Tag kTags[] = {dicom::tag::kSopClassUid,
                                dicom::tag::kAcquisitionTime,
                                dicom::tag::kModality,
                                dicom::tag::kPresentationIntentType,
                                dicom::tag::kRecommendedDisplayFrameRate,
                                dicom::tag::kCineRate,
                                dicom::tag::kFrameTime,
                                dicom::tag::kFrameTimeVector,
                                dicom::tag::kDistanceSourceToDetector,
                                dicom::tag::kDistanceSourceToPatient,
                                dicom::tag::kEstimatedRadiographicMagnificationFactor,
                                dicom::tag::kFieldOfViewShape,
                                dicom::tag::kFieldOfViewDimensions,
                                dicom::tag::kIntensifierSize,
                                dicom::tag::kImagerPixelSpacing,
                                dicom::tag::kPositionerPrimaryAngle,
                                dicom::tag::kPositionerSecondaryAngle,
                                dicom::tag::kPositionerPrimaryAngleIncrement,
                                dicom::tag::kPositionerSecondaryAngleIncrement,
                                dicom::tag::kDetectorPrimaryAngle,
                                dicom::tag::kDetectorSecondaryAngle,
                                dicom::tag::kShutter,
                                dicom::tag::kCollimator,
                                dicom::tag::kPatientPosition,
                                dicom::tag::kViewPosition,
                                dicom::tag::kDetectorBinning,
                                dicom::tag::kDetectorElementSpacing,
                                dicom::tag::kDetectorActiveDimensions,
                                dicom::tag::kDetectorActiveOrigin,
                                dicom::tag::kFieldOfViewOrigin,
                                dicom::tag::kFieldOfViewRotation,
                                dicom::tag::kFieldOfViewHorizontalFlip,
                                dicom::tag::kFrameAcquisitionDateTime,
                                dicom::tag::kDistanceSourceToIsocenter,
                                dicom::tag::kPhysicalDetectorSize,
                                dicom::tag::kPositionOfIsocenterProjection,
                                dicom::tag::kFieldOfViewDimensionsInFloat,
                                dicom::tag::kSeriesInstanceUid,
                                dicom::tag::kInstanceNumber,
                                dicom::tag::kPatientOrientation,
                                dicom::tag::kPhotometricInterpretation,
                                dicom::tag::kPixelSpacing,
                                dicom::tag::kPixelSpacingCalibrationType,
                                dicom::tag::kPixelIntensityRelationship,
                                dicom::tag::kPixelIntensityRelationshipSign,
                                dicom::tag::kWindowCenter,
                                dicom::tag::kRescaleIntercept,
                                dicom::tag::kRescaleSlope,
                                dicom::tag::kLossyImageCompression,
                                dicom::tag::kModalityLutSequence,
                                dicom::tag::kLutDescriptor,
                                dicom::tag::kLutData,
                                dicom::tag::kVoiLutSequence,
                                dicom::tag::kPixelIntensityRelationshipLutSequence};

/// One of those that are looked at, an attribute of a shutter or collimator, one of the functional groups of enhanced
/// DICOM, or any other.
dicom::Tag tagOf(Bytes* bytes) {
  const auto choice = bytes->take<std::uint8_t>();
  constexpr std::size_t kKnown = sizeof(kTags) / sizeof(kTags[0]);
  if (choice < kKnown) return kTags[choice];
  if (choice < 100) return dicom::tag::kShutter + 2 * (choice % 17U);
  if (choice < 120) return dicom::tag::kCollimator + 2 * (choice % 17U);
  if (choice < 140) return 0x52009229;
  if (choice < 160) return 0x52009230;
  if (choice < 180) return 0x30BB0000U | bytes->take<std::uint16_t>();
  return bytes->take<std::uint32_t>();
}

dicom::DataSet dataSetOf(Bytes* bytes, int depth);

dicom::Element elementOf(Bytes* bytes, int depth) {
  dicom::Element element;
  const auto kind = bytes->take<std::uint8_t>();
  const int count = bytes->take<std::uint8_t>() % 16;
  for (int i = 0; i < count; ++i) {
    switch (kind % 5) {
      case 0:
        element.numbers.push_back(bytes->take<double>());
        break;
      case 1:
        element.numbers.push_back(bytes->take<std::int16_t>());
        break;
      case 2:
        element.words.push_back(bytes->text(bytes->take<std::uint8_t>() % 24));
        break;
      case 3:
        element.bytes += bytes->text(bytes->take<std::uint8_t>());
        break;
      default:
        if (depth < kDeepest && bytes->left() > 0) element.items.push_back(dataSetOf(bytes, depth + 1));
    }
  }
  return element;
}

dicom::DataSet dataSetOf(Bytes* bytes, int depth) {
  dicom::DataSet set;
  const int count = bytes->take<std::uint8_t>() % 32;
  for (int i = 0; i < count && bytes->left() > 0; ++i) {
    const dicom::Tag tag = tagOf(bytes);
    set.elements[tag] = elementOf(bytes, depth);
  }
  return set;
}

}  // namespace
}  // namespace xray_registration::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  fuzz::Bytes bytes(data, size);
  const int frames = 1 + bytes.take<std::uint8_t>() % 4;
  const int width = 1 + bytes.take<std::uint16_t>() % 4096;
  const int height = 1 + bytes.take<std::uint16_t>() % 4096;
  const dicom::DataSet file = fuzz::dataSetOf(&bytes, 0);
  DicomHeader header = dicom::headerOf(file, static_cast<std::size_t>(frames));
  header.width = width;
  header.height = height;
  pixelMeaning(header);
  for (const DicomFrame& frame : header.frames) {
    const DicomGeometry geometry = dicomGeometry(header, frame);
    fuzz::require(geometry.mirrored.value.has_value(), "whether it is mirrored is always said");
    if (geometry.T_camera_isocentre) {
      fuzz::require(geometry.T_camera_isocentre->matrix().allFinite(), "a pose is finite");
    }
    if (geometry.camera) {
      fuzz::require(std::string(geometry.camera->problem()).empty(), "a camera that is made is usable");
    }
    if (width * height < 10000) shutterMask(header, frame);
  }
  return 0;
}

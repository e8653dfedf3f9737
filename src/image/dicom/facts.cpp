#include "image/dicom/facts.h"

#include <algorithm>

#include "image/dicom/frame_times.h"
#include "image/dicom/loop_x.h"
#include "image/dicom/tags.h"

namespace xray_registration::dicom {
namespace {

/// Writers put 0 where they do not know.
std::optional<double> positive(std::optional<double> value) { return value && *value > 0.0 ? value : std::nullopt; }

std::optional<RowColumn> positive(std::optional<RowColumn> value) {
  return value && (*value)[0] > 0.0 && (*value)[1] > 0.0 ? value : std::nullopt;
}

std::optional<double> firstOf(std::optional<double> a, std::optional<double> b) { return a ? a : b; }

/// The angle of the first frame, and how much the frame differs from it.
std::optional<double> angleOf(const Scopes& scopes, Tag angle, Tag increments, std::size_t frame) {
  std::optional<double> value = scopes.number(angle);
  const auto steps = scopes.numbers(increments);
  if (!value || frame >= steps.size()) return value;
  return *value + steps[frame];
}

void readDistances(const Scopes& scopes, DicomFrame* frame) {
  frame->source_detector_mm = positive(scopes.number(tag::kDistanceSourceToDetector));
  frame->source_isocentre_mm = firstOf(positive(scopes.number(tag::kDistanceSourceToIsocenter)),
                                       positive(scopes.number(tag::kDistanceSourceToPatient)));
  frame->magnification = positive(scopes.number(tag::kEstimatedRadiographicMagnificationFactor));
}

void readDetector(const Scopes& scopes, DicomFrame* frame) {
  frame->imager_spacing_mm = positive(scopes.pair(tag::kImagerPixelSpacing));
  frame->pixel_spacing_mm = positive(scopes.pair(tag::kPixelSpacing));
  frame->pixel_spacing_calibration = scopes.word(tag::kPixelSpacingCalibrationType);
  frame->element_spacing_mm = positive(scopes.pair(tag::kDetectorElementSpacing));
  frame->element_binning = positive(scopes.pair(tag::kDetectorBinning));
  frame->intensifier_mm = positive(scopes.number(tag::kIntensifierSize));
  frame->isocentre_on_detector = scopes.pair(tag::kPositionOfIsocenterProjection);
  frame->detector_primary_deg = scopes.number(tag::kDetectorPrimaryAngle);
  frame->detector_secondary_deg = scopes.number(tag::kDetectorSecondaryAngle);
  frame->detector_mm = positive(scopes.pair(tag::kPhysicalDetectorSize));
  if (frame->detector_mm) return;
  frame->detector_mm = positive(scopes.pair(tag::kDetectorActiveDimensions));
  frame->detector_origin = scopes.pair(tag::kDetectorActiveOrigin).value_or(RowColumn{});
}

void readField(const Scopes& scopes, DicomFrame* frame) {
  frame->field_shape = scopes.word(tag::kFieldOfViewShape);
  frame->field_mm = scopes.numbers(tag::kFieldOfViewDimensionsInFloat);
  if (frame->field_mm.empty()) frame->field_mm = scopes.numbers(tag::kFieldOfViewDimensions);
  const auto is_length = [](double value) { return value > 0.0; };
  if (!std::all_of(frame->field_mm.begin(), frame->field_mm.end(), is_length)) frame->field_mm.clear();
  frame->field_origin = scopes.pair(tag::kFieldOfViewOrigin);
  frame->field_rotation_deg = scopes.number(tag::kFieldOfViewRotation);
  const std::string flip = scopes.word(tag::kFieldOfViewHorizontalFlip);
  if (!flip.empty()) frame->field_flipped = flip == "YES";
}

DicomFrame frameOf(const DataSet& file, std::size_t index) {
  const Scopes scopes(file, index);
  DicomFrame frame;
  readDistances(scopes, &frame);
  readDetector(scopes, &frame);
  readField(scopes, &frame);
  frame.primary_deg = angleOf(scopes, tag::kPositionerPrimaryAngle, tag::kPositionerPrimaryAngleIncrement, index);
  frame.secondary_deg = angleOf(scopes, tag::kPositionerSecondaryAngle, tag::kPositionerSecondaryAngleIncrement, index);
  frame.patient_orientation = scopes.words(tag::kPatientOrientation);
  frame.view_position = scopes.word(tag::kViewPosition);
  frame.shutter = shutterOf(scopes, tag::kShutter);
  frame.collimator = shutterOf(scopes, tag::kCollimator);
  frame.vendor = loopXProjection(file);
  return frame;
}

bool hasLut(const Scopes& scopes) {
  return scopes.find(tag::kModalityLutSequence) != nullptr ||
         scopes.find(tag::kPixelIntensityRelationshipLutSequence) != nullptr;
}

}  // namespace

DicomShutter shutterOf(const Scopes& scopes, Tag base) {
  const auto at = [base](Tag offset) { return base + offset; };
  DicomShutter shutter;
  const auto shapes = scopes.words(base);
  const auto has = [&shapes](const char* shape) {
    return std::find(shapes.begin(), shapes.end(), shape) != shapes.end();
  };
  const auto left = scopes.number(at(0x02)), right = scopes.number(at(0x04));
  const auto upper = scopes.number(at(0x06)), lower = scopes.number(at(0x08));
  if (has("RECTANGULAR") && left && right && upper && lower) {
    shutter.rectangle = DicomShutter::Rectangle{*left, *right, *upper, *lower};
  }
  const auto centre = scopes.pair(at(0x10));
  const auto radius = scopes.number(at(0x12));
  if (has("CIRCULAR") && centre && radius) shutter.circle = DicomShutter::Circle{(*centre)[0], (*centre)[1], *radius};
  const auto vertices = scopes.numbers(at(0x20), 6);
  if (has("POLYGONAL")) {
    for (std::size_t i = 0; i + 1 < vertices.size(); i += 2) shutter.polygon.push_back({vertices[i], vertices[i + 1]});
  }
  return shutter;
}

DicomHeader headerOf(const DataSet& file, std::size_t frame_count) {
  const Scopes scopes(file, 0);
  DicomHeader header;
  header.modality = scopes.word(tag::kModality);
  header.photometric = scopes.word(tag::kPhotometricInterpretation);
  header.relationship = scopes.word(tag::kPixelIntensityRelationship);
  header.relationship_sign = scopes.number(tag::kPixelIntensityRelationshipSign);
  header.has_lut = hasLut(scopes);
  header.is_for_presentation = scopes.word(tag::kPresentationIntentType) == "FOR PRESENTATION";
  header.has_window = scopes.find(tag::kWindowCenter) != nullptr || scopes.find(tag::kVoiLutSequence) != nullptr;
  header.patient_position = scopes.word(tag::kPatientPosition);
  header.lossy = scopes.word(tag::kLossyImageCompression) == "01";
  header.series = scopes.word(tag::kSeriesInstanceUid);
  header.number = scopes.number(tag::kInstanceNumber);
  header.clock_s = secondsOfDay(scopes.word(tag::kAcquisitionTime));
  for (std::size_t i = 0; i < frame_count; ++i) header.frames.push_back(frameOf(file, i));
  setFrameTimes(file, &header);
  return header;
}

}  // namespace xray_registration::dicom

#include "image/dicom/detector.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace xray_registration::dicom {
namespace {

constexpr double kSameSize = 0.01;  // Share by which two statements of one size may differ.

std::string inWords(const RowColumn& size) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.5g x %.5g mm", size[0], size[1]);
  return text.data();
}

bool isSame(const RowColumn& a, const RowColumn& b) {
  return std::abs(a[0] / b[0] - 1.0) < kSameSize && std::abs(a[1] / b[1] - 1.0) < kSameSize;
}

/// Rows and columns as the detector has them, before the field's rotation.
RowColumn fieldPixels(const DicomHeader& header, const DicomFrame& frame) {
  const bool on_its_side = std::lround(frame.field_rotation_deg.value_or(0.0) / 90.0) % 2 != 0;
  const double rows = header.height, columns = header.width;
  return on_its_side ? RowColumn{columns, rows} : RowColumn{rows, columns};
}

Stated<RowColumn> fromElements(const DicomFrame& frame) {
  const RowColumn& element = *frame.element_spacing_mm;
  if (!frame.element_binning) return {element, "DetectorElementSpacing (0018,7022), not binned", true};
  const RowColumn& binning = *frame.element_binning;
  return {RowColumn{element[0] * binning[0], element[1] * binning[1]},
          "DetectorElementSpacing (0018,7022) times DetectorBinning (0018,701a)"};
}

std::optional<RowColumn> fieldSize(const DicomHeader& header, const DicomFrame& frame) {
  if (frame.field_mm.empty()) return std::nullopt;
  if (frame.field_mm.size() >= 2) {
    return RowColumn{frame.field_mm[0] / header.height, frame.field_mm[1] / header.width};
  }
  const double size = frame.field_mm[0] / std::min(header.height, header.width);
  return RowColumn{size, size};
}

/// Without a binning, elements are pixels when all of the detector is in the picture.
bool elementsArePixels(const DicomHeader& header, const DicomFrame& frame) {
  if (frame.element_binning || !frame.detector_mm) return frame.element_binning.has_value();
  const RowColumn pixels = fieldPixels(header, frame);
  return isSame(*frame.element_spacing_mm, {(*frame.detector_mm)[0] / pixels[0], (*frame.detector_mm)[1] / pixels[1]});
}

Stated<RowColumn> bestPixelSize(const DicomHeader& header, const DicomFrame& frame) {
  if (frame.imager_spacing_mm) return {frame.imager_spacing_mm, "ImagerPixelSpacing (0018,1164)"};
  if (frame.element_spacing_mm && elementsArePixels(header, frame)) return fromElements(frame);
  if (frame.pixel_spacing_mm && !frame.pixel_spacing_calibration.empty() && frame.magnification) {
    const double factor = *frame.magnification;
    return {RowColumn{(*frame.pixel_spacing_mm)[0] * factor, (*frame.pixel_spacing_mm)[1] * factor},
            "PixelSpacing (0028,0030) times the magnification (0018,1114)", true};
  }
  if (const auto size = fieldSize(header, frame)) {
    return {size, "FieldOfViewDimensions (0018,1149) over the picture", true};
  }
  if (frame.element_spacing_mm) return fromElements(frame);
  if (frame.intensifier_mm) {
    const double size = *frame.intensifier_mm / std::min(header.height, header.width);
    return {RowColumn{size, size}, "IntensifierSize (0018,1162) over the picture", true};
  }
  return {};
}

/// From detector elements (row, column from the middle of the first) to the stored picture's pixels.
Eigen::Vector2d storedPixel(const DicomHeader& header, const DicomFrame& frame, const RowColumn& pixel_mm,
                            const RowColumn& element) {
  const RowColumn size = fieldPixels(header, frame);
  const RowColumn origin = *frame.field_origin;
  const bool on_its_side = size[0] != header.height;
  // Pixels and elements have their corners in common.
  const double element_per_row = (on_its_side ? pixel_mm[1] : pixel_mm[0]) / (*frame.element_spacing_mm)[0];
  const double element_per_column = (on_its_side ? pixel_mm[0] : pixel_mm[1]) / (*frame.element_spacing_mm)[1];
  double v = (element[0] + 0.5 - origin[0]) / element_per_row - 0.5;
  double u = (element[1] + 0.5 - origin[1]) / element_per_column - 0.5;
  RowColumn extent = size;
  const int quarters = static_cast<int>(std::lround(frame.field_rotation_deg.value_or(0.0) / 90.0)) & 3;
  for (int i = 0; i < quarters; ++i) {
    const double above = v;
    v = u;
    u = extent[0] - 1.0 - above;
    std::swap(extent[0], extent[1]);
  }
  if (frame.field_flipped.value_or(false)) u = extent[1] - 1.0 - u;
  return {u, v};
}

}  // namespace

Stated<RowColumn> pixelSize(const DicomHeader& header, const DicomFrame& frame, const GivenGeometry& given,
                            std::vector<std::string>* warnings) {
  if (given.pixel_mm) return {given.pixel_mm, "--pixel-mm"};
  Stated<RowColumn> size = bestPixelSize(header, frame);
  if (!size.value) return size;
  if (size.estimate) {
    warnings->push_back("the size of a pixel, " + inWords(*size.value) + ", is an estimate from " + size.source +
                        "; if you know it, say --pixel-mm");
  }
  const auto field = fieldSize(header, frame);
  if (field && !size.estimate && !isSame(*field, *size.value)) {
    warnings->push_back("the field of view (0018,1149) would make a pixel " + inWords(*field) + ", " + size.source +
                        " says " + inWords(*size.value) + ", which is used");
  }
  return size;
}

Stated<Eigen::Vector2d> principalPoint(const DicomHeader& header, const DicomFrame& frame,
                                       const Stated<RowColumn>& pixel_mm, const GivenGeometry& given) {
  if (given.principal_point_px) return {given.principal_point_px, "--principal-point-px"};
  if (pixel_mm.value && frame.element_spacing_mm && frame.field_origin) {
    if (frame.isocentre_on_detector) {
      return {storedPixel(header, frame, *pixel_mm.value, *frame.isocentre_on_detector),
              "PositionOfIsocenterProjection (0018,9430)"};
    }
    if (frame.detector_mm) {
      RowColumn middle{};
      for (std::size_t i = 0; i < 2; ++i) {
        middle[i] = frame.detector_origin[i] + 0.5 * (*frame.detector_mm)[i] / (*frame.element_spacing_mm)[i] - 0.5;
      }
      return {storedPixel(header, frame, *pixel_mm.value, middle),
              "middle of the detector, FieldOfViewOrigin (0018,7030)"};
    }
  }
  return {Eigen::Vector2d(0.5 * (header.width - 1), 0.5 * (header.height - 1)), "middle of the picture"};
}

}  // namespace xray_registration::dicom

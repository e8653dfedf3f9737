#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/common/escaped.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// A file that is no X-ray in DICOM, or whose pixels cannot be read; the message names the file.
class XrayDicomError : public EscapedError {
 public:
  using EscapedError::EscapedError;
};

/// Two numbers in DICOM's order: the vertical one (of rows) first, then the horizontal one (of columns).
using RowColumn = std::array<double, 2>;

/// What covers a picture, in DICOM's pixels: column and row numbers from 1. What is inside all parts is seen.
struct DicomShutter {
  struct Rectangle {
    double left = 0.0, right = 0.0, upper = 0.0, lower = 0.0;
  };
  struct Circle {
    double row = 0.0, column = 0.0, radius = 0.0;
  };
  std::optional<Rectangle> rectangle;
  std::optional<Circle> circle;
  std::vector<RowColumn> polygon;  ///< Empty for none.
};

/// A projection that a maker states in attributes of its own.
struct VendorProjection {
  std::string source;  ///< Whose, and where it stands.
  /// Maps points of the patient (LPS directions, mm, from the device's isocentre) to columns and rows in mm on the
  /// detector, from the middle of the stored picture's first pixel, homogeneous.
  Eigen::Matrix<double, 3, 4> detector_from_patient = Eigen::Matrix<double, 3, 4>::Zero();
};

/// What the file says of one frame's geometry. Empty: it says nothing, or zero where zero is impossible.
struct DicomFrame {
  double time_s = 0.0;                          ///< After the first frame.
  std::optional<double> source_detector_mm;     ///< (0018,1110)
  std::optional<double> source_isocentre_mm;    ///< (0018,1111), (0018,9402)
  std::optional<double> magnification;          ///< (0018,1114), the first over the second.
  std::optional<RowColumn> imager_spacing_mm;   ///< (0018,1164): pixels where the detector is.
  std::optional<RowColumn> pixel_spacing_mm;    ///< (0028,0030): where nobody knows, unless
  std::string pixel_spacing_calibration;        ///< (0028,0A02) says.
  std::optional<RowColumn> element_spacing_mm;  ///< (0018,7022): of the detector's own elements,
  std::optional<RowColumn> element_binning;     ///< (0018,701A) of which so many make a pixel.
  std::string field_shape;                      ///< (0018,1147): ROUND, RECTANGLE, HEXAGONAL.
  std::vector<double> field_mm;                 ///< (0018,1149), (0018,9461): a diameter, or rows' and columns' length.
  std::optional<RowColumn> field_origin;        ///< (0018,7030), elements of the detector.
  std::optional<double> field_rotation_deg;     ///< (0018,7032), clockwise.
  std::optional<bool> field_flipped;            ///< (0018,7034), after that.
  std::optional<double> intensifier_mm;         ///< (0018,1162), diameter of the whole input.
  std::optional<RowColumn> detector_mm;         ///< (0018,9429), or of the active part, (0018,7026).
  RowColumn detector_origin{};                  ///< (0018,7028): where the active part begins, elements.
  std::optional<RowColumn> isocentre_on_detector;  ///< (0018,9430), elements, from the middle of the first.
  std::optional<double> primary_deg;               ///< (0018,1510), with the frame's increment.
  std::optional<double> secondary_deg;             ///< (0018,1511)
  std::optional<double> detector_primary_deg;      ///< (0018,1530): how the detector stands to the beam.
  std::optional<double> detector_secondary_deg;    ///< (0018,1531)
  std::vector<std::string> patient_orientation;    ///< (0020,0020): where rows and columns lead, as {"L", "F"}.
  std::string view_position;                       ///< (0018,5101): AP, PA, LL, RL.
  DicomShutter shutter;                            ///< (0018,16xx)
  DicomShutter collimator;                         ///< (0018,17xx)
  std::optional<VendorProjection> vendor;
};

/// What the file says of all of its frames. Nothing of it tells who the patient is, or when.
struct DicomHeader {
  std::string modality;         ///< XA, RF, DX, CR, …
  std::string transfer_syntax;  ///< In words.
  bool lossy = false;
  int width = 0;
  int height = 0;
  int bits = 0;                             ///< Stored per pixel.
  std::string photometric;                  ///< MONOCHROME1 or 2.
  std::string relationship;                 ///< (0028,1040): LIN, LOG, DISP; empty for none.
  std::optional<double> relationship_sign;  ///< (0028,1041): 1, more X-rays make larger values; −1, smaller ones.
  bool has_lut = false;                     ///< A table that makes the values linear (0028,3000), (0028,9422).
  bool is_for_presentation = false;         ///< (0008,0068)
  bool has_window = false;                  ///< (0028,1050), (0028,3010): for displays, not applied.
  std::string patient_position;             ///< (0018,5100), as HFS.
  std::string series;                       ///< Tells series apart; not to be shown.
  std::optional<double> number;             ///< (0020,0013), the place in the series.
  std::optional<double> clock_s;            ///< Of the acquisition; only differences are to be used.
  std::string time_source;                  ///< Which attribute the frames' times are from; empty: none.
  std::vector<DicomFrame> frames;
};

/// What the values of a picture mean, and how they are written.
struct PixelMeaning {
  bool is_attenuation = false;  ///< Written are logarithms (ImageKind::kAttenuation), else intensities.
  bool reversed = false;        ///< Full scale minus the stored value is written.
  bool assumed = false;         ///< The file does not say; this is usual for its kind.
  std::string in_words;
};
PixelMeaning pixelMeaning(const DicomHeader& header);

/// An X-ray in DICOM: XA, RF, DX, CR, whatever else is monochrome; single and multi-frame; enhanced too; compressed in
/// any way that GDCM reads. One file at a time in a process. Not thread-safe.
class XrayDicomFile {
 public:
  /// Reads everything. @throws XrayDicomError
  explicit XrayDicomFile(const std::string& path);
  ~XrayDicomFile();
  XrayDicomFile(XrayDicomFile&&) noexcept;
  XrayDicomFile& operator=(XrayDicomFile&&) noexcept;

  const DicomHeader& header() const;

  /// Largest value that a pixel can have.
  double fullScale() const;
  /// Whether pixels are whole numbers from 0 to 65535.
  bool isIntegral() const;
  /// The stored values; rescaled, or linearised by the table, where the file says how. Signed ones are counted from 0.
  /// @param reversed  Full scale minus the value, see PixelMeaning.
  /// @throws std::out_of_range
  FloatImage frame(std::size_t index, bool reversed) const;

 private:
  struct Contents;
  std::unique_ptr<Contents> contents_;
};

/// Whether the file begins as DICOM does; false for what cannot be opened.
bool looksLikeDicom(const std::string& path);

/// 255 where the picture is seen, 0 behind shutters and collimator. Empty when the frame has none, or when they would
/// cover nearly everything.
MaskImage shutterMask(const DicomHeader& header, const DicomFrame& frame);

}  // namespace xray_registration

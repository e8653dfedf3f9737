#include "dicom_series.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

using Vector = std::array<double, 3>;

// Positions are written with a tenth of a millimetre by some scanners: half of that on either side.
constexpr double kPositionTolerance_mm = 0.06;
constexpr double kPositionToleranceShare = 0.02;  // Of the spacing.
constexpr double kSameDirection = 1e-3;           // Largest difference of two unit vectors' components.
constexpr double kMaxTilt = 0.002;                // Sideways per millimetre along the normal: 0.1 degrees.
constexpr double kGapOfMissingSlice = 1.5;        // Of the usual spacing.

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double largestDifference(const Vector& a, const Vector& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < 3; ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

std::string fileName(const DicomSlice& slice) { return std::filesystem::path(slice.path).filename().string(); }

// "12.5 mm (I10.dcm)": a place along the normal and the file there.
std::string placeOf(const DicomSlice& slice, double position_mm) {
  std::ostringstream text;
  text << position_mm << " mm (" << fileName(slice) << ")";
  return text.str();
}

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw VolumeError("'" + where + "': " + what);
}

void checkEachSlice(const std::vector<DicomSlice>& slices, const std::string& where) {
  const DicomSlice& first = slices.front();
  for (const DicomSlice& slice : slices) {
    const std::string name = fileName(slice);
    if (slice.components != 1) refuse(where, name + " is a colour image; a CT has one number per pixel");
    if (slice.frames != 1) {
      refuse(where, name +
                        " holds several frames (enhanced DICOM), whose places are not checked; convert it to "
                        "single-frame DICOM or NIfTI");
    }
    if (!slice.has_room) refuse(where, name + " is truncated or damaged: it ends before its last pixel");
    if (slice.has_value_table) {
      refuse(where, name + " gives its values by a table (Modality LUT), which is not read; convert the series first");
    }
    if (!slice.has_geometry) {
      refuse(where, name + " does not state its position, orientation and pixel spacing");
    }
    if (slice.columns != first.columns || slice.rows != first.rows) {
      refuse(where, name + " differs in size from " + fileName(first) + "; the series holds more than one volume");
    }
    if (!(slice.column_spacing_mm > 0.0 && slice.row_spacing_mm > 0.0)) {
      refuse(where, name + " states a pixel spacing that is not positive; export the series again");
    }
    if (std::abs(slice.column_spacing_mm - first.column_spacing_mm) > 1e-4 ||
        std::abs(slice.row_spacing_mm - first.row_spacing_mm) > 1e-4) {
      refuse(where, name + " differs in pixel spacing from " + fileName(first));
    }
    if (largestDifference(slice.along_row, first.along_row) > kSameDirection ||
        largestDifference(slice.along_column, first.along_column) > kSameDirection) {
      refuse(where, name + " is oriented otherwise than " + fileName(first) + "; the series holds a localizer?");
    }
  }
  if (!(std::abs(dot(first.along_row, first.along_row) - 1.0) < kSameDirection &&
        std::abs(dot(first.along_column, first.along_column) - 1.0) < kSameDirection &&
        std::abs(dot(first.along_row, first.along_column)) < kSameDirection)) {
    refuse(where, fileName(first) + " states an orientation whose axes are not unit vectors at right angles");
  }
}

bool hasSamePixels(const DicomSlice& a, const DicomSlice& b) {
  const std::size_t count = static_cast<std::size_t>(a.columns) * static_cast<std::size_t>(a.rows);
  std::vector<std::int16_t> of_a(count);
  std::vector<std::int16_t> of_b(count);
  ValueFacts unused;
  readDicomPixels(a, {}, of_a.data(), &unused);
  readDicomPixels(b, {}, of_b.data(), &unused);
  return of_a == of_b;
}

// The pixels are only read of what is the same in all else.
bool isCopy(const DicomSlice& a, const DicomSlice& b) {
  if (a.columns != b.columns || a.rows != b.rows || a.frames != b.frames || a.components != b.components) return false;
  if (a.frames != 1 || a.components != 1 || !a.has_room || !b.has_room) return false;
  return a.has_geometry == b.has_geometry && a.position_mm == b.position_mm && a.along_row == b.along_row &&
         a.along_column == b.along_column && hasSamePixels(a, b);
}

void checkGaps(const std::vector<DicomSlice>& slices, const std::vector<double>& places, const std::string& where) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < places.size(); ++i) gaps.push_back(places[i] - places[i - 1]);
  std::vector<double> sorted = gaps;
  std::sort(sorted.begin(), sorted.end());
  const double usual = sorted[(sorted.size() - 1) / 2];
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const std::string between = placeOf(slices[i], places[i]) + " and " + placeOf(slices[i + 1], places[i + 1]);
    if (gaps[i] < 1e-3) {
      refuse(where, "several slices lie in one place, " + between +
                        "; the series holds more than one volume (phases, repeats): split it");
    }
  }
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    if (gaps[i] <= kGapOfMissingSlice * usual) continue;
    std::ostringstream message;
    message << "slices are missing between " << placeOf(slices[i], places[i]) << " and "
            << placeOf(slices[i + 1], places[i + 1]) << ": " << gaps[i] << " mm apart where " << usual
            << " mm is usual";
    refuse(where, message.str());
  }
}

void checkEven(const std::vector<DicomSlice>& slices, const std::vector<double>& places, const std::string& where) {
  const double spacing = (places.back() - places.front()) / static_cast<double>(places.size() - 1);
  const double tolerance = std::max(kPositionTolerance_mm, kPositionToleranceShare * spacing);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double expected = places.front() + static_cast<double>(i) * spacing;
    if (std::abs(places[i] - expected) <= tolerance) continue;
    std::ostringstream message;
    message << "the slices are unevenly spaced: the one at " << placeOf(slices[i], places[i]) << " should lie at "
            << expected << " mm; resample the series to even spacing first";
    refuse(where, message.str());
  }
}

void checkTilt(const std::vector<DicomSlice>& slices, const Vector& normal, const std::string& where) {
  const Vector& first = slices.front().position_mm;
  const double pitch = dot(slices.back().position_mm, normal) - dot(first, normal);
  for (const DicomSlice& slice : slices) {
    Vector sideways;
    for (std::size_t i = 0; i < 3; ++i) sideways[i] = slice.position_mm[i] - first[i];
    const double along = dot(sideways, normal);
    for (std::size_t i = 0; i < 3; ++i) sideways[i] -= along * normal[i];
    const double shift = std::sqrt(dot(sideways, sideways));
    if (shift <= kPositionTolerance_mm + kMaxTilt * pitch) continue;
    std::ostringstream message;
    message << "gantry tilt: " << fileName(slice) << " lies " << shift << " mm beside the line through "
            << fileName(slices.front()) << " along the slices' normal; resample the series to right angles first";
    refuse(where, message.str());
  }
}

}  // namespace

std::size_t dropCopies(std::vector<DicomSlice>* slices) {
  std::map<std::string, std::vector<DicomSlice>> by_uid;
  std::vector<DicomSlice> kept;
  std::size_t sharing = 0;
  for (DicomSlice& slice : *slices) {
    std::vector<DicomSlice>& same = by_uid[slice.instance_uid];
    const bool is_copy =
        !slice.instance_uid.empty() &&
        std::any_of(same.begin(), same.end(), [&](const DicomSlice& other) { return isCopy(slice, other); });
    if (is_copy) continue;
    if (!slice.instance_uid.empty() && !same.empty()) ++sharing;
    same.push_back(slice);
    kept.push_back(std::move(slice));
  }
  *slices = std::move(kept);
  return sharing;
}

DicomStack stackedSlices(std::vector<DicomSlice> slices, const std::string& where) {
  if (slices.empty()) refuse(where, "the series has no slices");
  checkEachSlice(slices, where);
  if (slices.size() < 2) refuse(where, "the series has a single slice; a CT volume has several");
  const Vector normal = cross(slices.front().along_row, slices.front().along_column);
  const auto place = [&normal](const DicomSlice& slice) { return dot(slice.position_mm, normal); };
  std::sort(slices.begin(), slices.end(), [&place](const DicomSlice& a, const DicomSlice& b) {
    return std::make_pair(place(a), a.path) < std::make_pair(place(b), b.path);
  });
  std::vector<double> places;
  places.reserve(slices.size());
  for (const DicomSlice& slice : slices) places.push_back(place(slice));
  checkGaps(slices, places, where);
  checkEven(slices, places, where);
  checkTilt(slices, normal, where);

  DicomStack stack;
  const DicomSlice& first = slices.front();
  stack.grid.size = {first.columns, first.rows, static_cast<int>(slices.size())};
  stack.grid.spacing_mm = {first.column_spacing_mm, first.row_spacing_mm,
                           (places.back() - places.front()) / static_cast<double>(places.size() - 1)};
  stack.grid.origin_mm = first.position_mm;
  stack.grid.axes = {first.along_row, first.along_column, normal};
  if (first.columns < 2 || first.rows < 2) refuse(where, "its slices are one pixel thin");
  stack.slices = std::move(slices);
  return stack;
}

}  // namespace xray_registration

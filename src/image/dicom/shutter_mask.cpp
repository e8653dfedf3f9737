#include <algorithm>
#include <cmath>

#include "xray_registration/image/xray_dicom.h"

namespace xray_registration {
namespace {

// A mask that leaves less than this is a file that means something else.
constexpr double kLeastSeenShare = 0.02;

/// Whether a point lies inside a polygon: an odd number of its edges cross the row to the right.
bool isInside(const std::vector<RowColumn>& polygon, double row, double column) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const auto& [row_i, column_i] = polygon[i];
    const auto& [row_j, column_j] = polygon[j];
    if ((row_i > row) == (row_j > row)) continue;
    if (column < column_i + (row - row_i) * (column_j - column_i) / (row_j - row_i)) inside = !inside;
  }
  return inside;
}

bool isSeen(const DicomShutter& shutter, double row, double column) {
  if (const auto& box = shutter.rectangle) {
    if (column < box->left || column > box->right || row < box->upper || row > box->lower) return false;
  }
  if (const auto& circle = shutter.circle) {
    if (std::hypot(row - circle->row, column - circle->column) > circle->radius) return false;
  }
  return shutter.polygon.empty() || isInside(shutter.polygon, row, column);
}

}  // namespace

MaskImage shutterMask(const DicomHeader& header, const DicomFrame& frame) {
  MaskImage mask(header.width, header.height);
  std::size_t seen = 0;
  for (int v = 0; v < header.height; ++v) {
    for (int u = 0; u < header.width; ++u) {
      if (!isSeen(frame.shutter, v + 1, u + 1) || !isSeen(frame.collimator, v + 1, u + 1)) continue;
      mask.at(u, v) = 255;
      ++seen;
    }
  }
  const bool useless = static_cast<double>(seen) < kLeastSeenShare * static_cast<double>(mask.pixels.size());
  return useless || seen == mask.pixels.size() ? MaskImage{} : mask;
}

}  // namespace xray_registration

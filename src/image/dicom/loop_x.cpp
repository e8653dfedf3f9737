#include "image/dicom/loop_x.h"

#include <Eigen/LU>
#include <cmath>
#include <cstring>

namespace xray_registration::dicom {
namespace {

constexpr Tag kGroup = 0x30BB0000;
constexpr char kCreator[] = "Navigation Registration 1.0";
constexpr Tag kMatrix = 0x73;
constexpr Tag kSource = 0x80;
// The source that the matrix has and the one that stands beside it, mm: they are stated in double precision.
constexpr double kSameSource_mm = 0.01;

/// A maker's block of a private group: the element that names the maker reserves it.
std::optional<Tag> blockOf(const DataSet& file) {
  for (Tag block = 0x10; block <= 0xFF; ++block) {
    const auto creator = file.elements.find(kGroup | block);
    if (creator == file.elements.end()) continue;
    const auto& words = creator->second.words;
    if (!words.empty() && words.front() == kCreator) return kGroup | (block << 8U);
  }
  return std::nullopt;
}

/// Doubles; as bytes where the file states no types.
std::vector<double> doublesOf(const DataSet& file, Tag tag) {
  const auto found = file.elements.find(tag);
  if (found == file.elements.end()) return {};
  if (!found->second.numbers.empty()) return found->second.numbers;
  const std::string& bytes = found->second.bytes;
  std::vector<double> values(bytes.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(double));
  return values;
}

/// The source stands once more beside the matrix, in the device's axes: (x, y, z) there is (−x, −z, −y) of the patient.
/// When the two disagree, the matrix is not what it is taken for.
bool agreesWithSource(const Eigen::Matrix<double, 3, 4>& projection, const std::vector<double>& source) {
  if (source.size() != 3) return false;
  const Eigen::Vector3d stated(-source[0], -source[2], -source[1]);
  const Eigen::Vector3d centre = -projection.leftCols<3>().inverse() * projection.col(3);
  return (centre - stated).norm() < kSameSource_mm;
}

}  // namespace

std::optional<VendorProjection> loopXProjection(const DataSet& file) {
  const auto block = blockOf(file);
  if (!block) return std::nullopt;
  const auto values = doublesOf(file, *block | kMatrix);
  if (values.size() != 16) return std::nullopt;
  VendorProjection projection;
  projection.source = "Loop-X " + inWords(*block | kMatrix);
  // 4 × 4 by rows, as for a display: columns, rows and their divisor are rows 0, 1 and 3; row 2 is a display's depth.
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) {
      projection.detector_from_patient(row, column) =
          values[static_cast<std::size_t>(4 * (row < 2 ? row : 3) + column)];
    }
  }
  if (!projection.detector_from_patient.allFinite()) return std::nullopt;
  if (!agreesWithSource(projection.detector_from_patient, doublesOf(file, *block | kSource))) return std::nullopt;
  return projection;
}

}  // namespace xray_registration::dicom

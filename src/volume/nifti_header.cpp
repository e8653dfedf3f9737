#include "nifti_header.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>

#include "file_grid.h"
#include "xray_registration/volume/volume_error.h"

// Fields and their meaning: nifti1.h and nifti2.h of the NIfTI Data Format Working Group.

namespace xray_registration {
namespace {

using Affine = Eigen::Matrix<double, 3, 4>;  // RAS from index, in the file's unit.

// Of the corners of the volume. Quaternions in single precision differ by less than a hundredth of it.
constexpr double kSamePlace_mm = 0.1;
constexpr double kSameSpacing = 0.01;  // Relative.
constexpr double kRightAngle = 1e-3;   // Of the dot product of two axes.

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

// Reads numbers at their places in the header.
class Fields {
 public:
  Fields(const std::vector<char>& bytes, bool swap) : bytes_(bytes), swap_(swap) {}

  template <typename T>
  T at(std::size_t offset) const {
    std::array<char, sizeof(T)> own{};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), sizeof(T), own.begin());
    if (swap_) std::reverse(own.begin(), own.end());
    T value;
    std::memcpy(&value, own.data(), sizeof(T));
    return value;
  }

 private:
  const std::vector<char>& bytes_;
  bool swap_;
};

// Both versions' fields in the larger types of the second.
struct RawHeader {
  std::array<std::int64_t, 8> dim{};
  std::int32_t datatype = 0;
  std::array<double, 8> pixdim{};
  double vox_offset = 0.0;
  double scl_slope = 0.0;
  double scl_inter = 0.0;
  std::int32_t units = 0;
  std::int32_t qform_code = 0;
  std::int32_t sform_code = 0;
  std::array<double, 6> quatern{};  // b, c, d and the offset
  std::array<double, 12> srow{};
};

template <typename Whole, typename Real, typename Code, typename Type>
RawHeader rawHeader(const Fields& fields, std::size_t dim, std::size_t type, std::size_t pixdim, std::size_t scale,
                    std::size_t codes, std::size_t quatern, std::size_t srow) {
  RawHeader raw;
  for (std::size_t i = 0; i < 8; ++i) raw.dim[i] = fields.at<Whole>(dim + i * sizeof(Whole));
  raw.datatype = fields.at<Type>(type);
  for (std::size_t i = 0; i < 8; ++i) raw.pixdim[i] = static_cast<double>(fields.at<Real>(pixdim + i * sizeof(Real)));
  raw.scl_slope = static_cast<double>(fields.at<Real>(scale));
  raw.scl_inter = static_cast<double>(fields.at<Real>(scale + sizeof(Real)));
  raw.qform_code = fields.at<Code>(codes);
  raw.sform_code = fields.at<Code>(codes + sizeof(Code));
  for (std::size_t i = 0; i < 6; ++i) raw.quatern[i] = static_cast<double>(fields.at<Real>(quatern + i * sizeof(Real)));
  for (std::size_t i = 0; i < 12; ++i) raw.srow[i] = static_cast<double>(fields.at<Real>(srow + i * sizeof(Real)));
  return raw;
}

RawHeader firstVersion(const Fields& fields) {
  RawHeader raw = rawHeader<std::int16_t, float, std::int16_t, std::int16_t>(fields, 40, 70, 76, 112, 252, 256, 280);
  raw.vox_offset = static_cast<double>(fields.at<float>(108));
  raw.units = fields.at<std::uint8_t>(123);
  return raw;
}

RawHeader secondVersion(const Fields& fields) {
  RawHeader raw = rawHeader<std::int64_t, double, std::int32_t, std::int16_t>(fields, 16, 12, 104, 176, 344, 352, 400);
  raw.vox_offset = static_cast<double>(fields.at<std::int64_t>(168));
  raw.units = fields.at<std::int32_t>(500);
  return raw;
}

// Bytes of one voxel; 0 for a type with several numbers or one that no CT has.
std::size_t bytesOf(std::int32_t datatype) {
  switch (datatype) {
    case 2:
    case 256:
      return 1;
    case 4:
    case 512:
      return 2;
    case 8:
    case 16:
    case 768:
      return 4;
    case 64:
    case 1024:
    case 1280:
      return 8;
    default:
      return 0;
  }
}

void checkType(std::int32_t datatype, const std::string& path) {
  if (bytesOf(datatype) > 0) return;
  if (datatype == 128 || datatype == 2304) {
    refuse(path, "it has " + std::string(datatype == 128 ? "3" : "4") +
                     " numbers per voxel (a colour or vector image); a CT has one");
  }
  refuse(path, "its voxels have a type that no CT has (NIfTI's datatype " + std::to_string(datatype) + ")");
}

std::array<int, 3> sizeOf(const RawHeader& raw, const std::string& path) {
  if (raw.dim[0] < 1 || raw.dim[0] > 7) refuse(path, "it is damaged: its header states no number of dimensions");
  for (std::int64_t i = 4; i <= raw.dim[0]; ++i) {
    if (raw.dim[static_cast<std::size_t>(i)] > 1) {
      refuse(path, "it has more than three dimensions; take one volume out of it");
    }
  }
  if (raw.dim[0] < 3 || raw.dim[3] < 2) refuse(path, "it holds a single slice; a CT volume has several");
  std::array<int, 3> size{};
  for (std::size_t i = 0; i < 3; ++i) {
    size[i] = static_cast<int>(std::clamp<std::int64_t>(raw.dim[i + 1], 0, std::numeric_limits<int>::max()));
  }
  return size;
}

StoredScale scaleOf(const RawHeader& raw, const std::string& path, std::vector<std::string>* warnings) {
  // A slope of zero means that nothing is to be scaled, the intercept included.
  if (raw.scl_slope == 0.0) return {};
  if (!std::isfinite(raw.scl_slope)) {
    warnings->push_back("its scl_slope is no number, its values are taken as they are stored");
    return {};
  }
  if (!std::isfinite(raw.scl_inter)) refuse(path, "its scl_inter is no number");
  return {raw.scl_slope, raw.scl_inter};
}

double unitOf(const RawHeader& raw, std::vector<std::string>* warnings) {
  switch (raw.units & 7) {
    case 1:
      return 1000.0;
    case 3:
      return 0.001;
    case 0:
    case 2:
      return 1.0;
    default:
      warnings->push_back("it states an unknown unit of length, taken as millimetres; ct/unit_mm says otherwise");
      return 1.0;
  }
}

Eigen::Vector3d spacingOf(const RawHeader& raw) {
  return {std::abs(raw.pixdim[1]), std::abs(raw.pixdim[2]), std::abs(raw.pixdim[3])};
}

std::optional<Affine> qformOf(const RawHeader& raw) {
  if (raw.qform_code <= 0) return std::nullopt;
  Eigen::Vector3d imaginary(raw.quatern[0], raw.quatern[1], raw.quatern[2]);
  const Eigen::Vector3d offset(raw.quatern[3], raw.quatern[4], raw.quatern[5]);
  if (!imaginary.allFinite() || !offset.allFinite() || imaginary.norm() > 1.01) return std::nullopt;
  if (imaginary.norm() > 1.0) imaginary.normalize();
  const double real = std::sqrt(std::max(0.0, 1.0 - imaginary.squaredNorm()));
  Affine result;
  result.leftCols<3>() = Eigen::Quaterniond(real, imaginary.x(), imaginary.y(), imaginary.z()).toRotationMatrix() *
                         spacingOf(raw).asDiagonal();
  if (raw.pixdim[0] < 0.0) result.col(2) *= -1.0;
  result.col(3) = offset;
  return result;
}

std::optional<Affine> sformOf(const RawHeader& raw) {
  if (raw.sform_code <= 0) return std::nullopt;
  const Affine result = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(raw.srow.data());
  if (!result.allFinite() || (result.leftCols<3>().colwise().norm().array() <= 0.0).any()) return std::nullopt;
  return result;
}

bool hasSpacing(const Affine& ras_from_index, const Eigen::Vector3d& spacing) {
  const Eigen::Vector3d own = ras_from_index.leftCols<3>().colwise().norm().transpose();
  return ((own - spacing).array().abs() <= kSameSpacing * spacing.array()).all();
}

bool isRightAngled(const Affine& ras_from_index) {
  const Eigen::Matrix3d axes = ras_from_index.leftCols<3>().colwise().normalized();
  return (axes.transpose() * axes - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRightAngle;
}

// How far apart two forms have a corner of the volume.
double largestDistance(const Affine& a, const Affine& b, const std::array<int, 3>& size) {
  double largest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector4d index(0.0, 0.0, 0.0, 1.0);
    for (int i = 0; i < 3; ++i) {
      if ((corner >> i) % 2 == 1) index[i] = size[static_cast<std::size_t>(i)] - 1;
    }
    largest = std::max(largest, ((a - b) * index).norm());
  }
  return largest;
}

std::string named(const std::string& form, int code) { return form + " (code " + std::to_string(code) + ")"; }

struct ChosenForm {
  Affine ras_from_index;
  std::string name;
};

// Both forms are given. The sform counts, unless it is none of a rigid body and the qform is.
ChosenForm chosenOfBoth(const RawHeader& raw, const Affine& sform, const Affine& qform, double unit_mm,
                        const std::array<int, 3>& size, std::vector<std::string>* warnings) {
  const std::string sform_name = named("sform", raw.sform_code);
  const std::string qform_name = named("qform", raw.qform_code);
  const bool sform_is_rigid = isRightAngled(sform) && hasSpacing(sform, spacingOf(raw));
  ChosenForm chosen = sform_is_rigid ? ChosenForm{sform, sform_name} : ChosenForm{qform, qform_name};
  const double distance_mm = unit_mm * largestDistance(sform, qform, size);
  if (distance_mm > kSamePlace_mm) {
    std::ostringstream text;
    text << "its " << sform_name << " and its " << qform_name << " disagree by " << distance_mm << " mm. The "
         << (sform_is_rigid ? "sform was taken"
                            : "qform was taken, since the sform shears or has other voxel sizes than pixdim")
         << "; if it is the wrong one, set its code in the file to 0";
    warnings->push_back(text.str());
  }
  return chosen;
}

ChosenForm chosenForm(const RawHeader& raw, const FileRule& rule, const std::string& path, double unit_mm,
                      const std::array<int, 3>& size, std::string* letters, std::vector<std::string>* warnings) {
  const auto sform = sformOf(raw);
  const auto qform = qformOf(raw);
  if (sform && qform) return chosenOfBoth(raw, *sform, *qform, unit_mm, size, warnings);
  if (sform) {
    if (!hasSpacing(*sform, spacingOf(raw))) {
      warnings->push_back("its sform and its pixdim state different voxel sizes; those of the sform are taken");
    }
    return {*sform, named("sform", raw.sform_code)};
  }
  if (qform) return {*qform, named("qform", raw.qform_code)};
  if (raw.sform_code > 0 || raw.qform_code > 0) {
    refuse(
        path,
        "its sform or qform is damaged: it holds no axes. Write it anew with the right one, or set the codes of both "
        "to 0 and say in ct/orientation how its voxels lie");
  }
  if (!rule.orientation.empty()) *letters = rule.orientation;
  ChosenForm chosen{Affine::Zero(), "pixdim alone, as " + *letters};
  chosen.ras_from_index.leftCols<3>() = spacingOf(raw).asDiagonal();
  if (rule.orientation.empty()) {
    warnings->push_back(
        "it does not say how its voxels lie (no sform or qform: their codes are " + std::to_string(raw.sform_code) +
        " and " + std::to_string(raw.qform_code) +
        "). As NIfTI has it for such files, x, y and z are taken to run to the right, front and head (RAS) from the "
        "origin; if that is wrong, left may be right. ct/orientation says how they run");
  }
  return chosen;
}

FileGrid gridOf(const RawHeader& raw, const FileRule& rule, const std::string& path, std::string* orientation,
                std::vector<std::string>* warnings) {
  FileGrid grid;
  grid.size = sizeOf(raw, path);
  const Eigen::Vector3d spacing = spacingOf(raw);
  if (raw.pixdim[1] < 0.0 || raw.pixdim[2] < 0.0 || raw.pixdim[3] < 0.0) {
    warnings->push_back("it states a negative voxel size (pixdim), whose sign says nothing and is not looked at");
  }
  if (!(spacing.array() > 0.0).all() || !spacing.allFinite()) {
    refuse(path, "it states a voxel size that is not positive (pixdim): write it anew with the right one");
  }
  const double unit_mm = rule.unit_mm > 0.0 ? rule.unit_mm : unitOf(raw, warnings);
  std::string letters = "RAS";
  const ChosenForm form = chosenForm(raw, rule, path, unit_mm, grid.size, &letters, warnings);
  *orientation = form.name;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    const Eigen::Vector3d column = form.ras_from_index.col(i);
    grid.spacing_mm[axis] = column.norm();
    grid.origin_mm[axis] = form.ras_from_index(i, 3);
    for (int j = 0; j < 3; ++j) grid.axes[axis][static_cast<std::size_t>(j)] = column[j] / column.norm();
  }
  turnToLps(letters, &grid);
  checkGrid(grid, path);
  scaleLengths(unit_mm, path, &grid);
  return grid;
}

}  // namespace

std::size_t niftiHeaderBytes(const std::vector<char>& first_bytes) {
  if (first_bytes.size() < kNiftiHeaderBytes) return 0;
  for (const bool swap : {false, true}) {
    const auto size = Fields(first_bytes, swap).at<std::int32_t>(0);
    if (size == static_cast<std::int32_t>(kNiftiHeaderBytes)) return kNiftiHeaderBytes;
    if (size == static_cast<std::int32_t>(kNifti2HeaderBytes)) return kNifti2HeaderBytes;
  }
  return 0;
}

NiftiHeader parsedNiftiHeader(const std::vector<char>& bytes, const FileRule& rule, const std::string& path) {
  NiftiHeader header;
  header.version = bytes.size() >= kNifti2HeaderBytes ? 2 : 1;
  header.swap = Fields(bytes, false).at<std::int32_t>(0) != static_cast<std::int32_t>(bytes.size());
  const std::string magic(&bytes[header.version == 1 ? 344 : 4], 3);
  const std::string number = std::to_string(header.version);
  if (magic != "n+" + number && magic != "ni" + number) {
    refuse(path, "it is no NIfTI file; an Analyze file does not state its frame and is not read");
  }
  header.detached = magic[1] == 'i';
  const Fields fields(bytes, header.swap);
  const RawHeader raw = header.version == 1 ? firstVersion(fields) : secondVersion(fields);
  checkType(raw.datatype, path);
  header.datatype = raw.datatype;
  header.bytes_per_voxel = bytesOf(raw.datatype);
  const double offset = raw.vox_offset > 0.0 && raw.vox_offset < 1e15 ? raw.vox_offset : 0.0;
  header.data_offset = static_cast<std::size_t>(offset);
  // Behind the header and four bytes that announce extensions.
  if (!header.detached) header.data_offset = std::max<std::size_t>(header.data_offset, bytes.size() + 4);
  header.grid = gridOf(raw, rule, path, &header.orientation, &header.warnings);
  header.scale = scaleOf(raw, path, &header.warnings);
  return header;
}

}  // namespace xray_registration

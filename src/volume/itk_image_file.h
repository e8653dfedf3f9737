#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

// What the readers need of ITK, in plain types: ITK's headers carry an Eigen of their own, which clashes with the
// project's in one translation unit. Lengths in mm, frame LPS.

namespace xray_registration {

struct FileGrid {
  std::array<int, 3> size{};
  std::array<double, 3> spacing_mm{1.0, 1.0, 1.0};
  std::array<double, 3> origin_mm{};
  std::array<std::array<double, 3>, 3> axes{};  ///< axes[i]: direction of index i.
};

template <typename T>
struct FileImage {
  FileGrid grid;
  std::vector<T> voxels;
};

/// Reads a NIfTI, NRRD, MetaImage or DICOM file with three dimensions and one number per voxel. Numbers are rounded and
/// clamped to the type; what is not a number becomes air (-1000) or background (0).
/// @throws VolumeError naming the file.
FileImage<std::int16_t> readHuFile(const std::string& path);
FileImage<std::uint16_t> readLabelFile(const std::string& path);

/// Writes by the path's extension. @throws VolumeError.
void writeHuFile(const FileGrid& grid, const std::vector<std::int16_t>& hu, const std::string& path);

/// What a DICOM file says about its place in a series; no patient data.
struct DicomSlice {
  std::string path;
  std::string series_uid;
  std::string instance_uid;
  std::string modality;
  int columns = 0;
  int rows = 0;
  int frames = 1;
  int components = 1;
  bool has_geometry = false;  ///< Position, orientation and pixel spacing are stated.
  std::array<double, 3> position_mm{};
  std::array<double, 3> along_row{};     ///< Direction of increasing column.
  std::array<double, 3> along_column{};  ///< Direction of increasing row.
  double column_spacing_mm = 0.0;        ///< Between columns, along a row.
  double row_spacing_mm = 0.0;
};

/// Empty when the file is no DICOM image.
std::optional<DicomSlice> readDicomHeader(const std::string& path);

/// Pixels in HU (rescaled), rows × columns. @throws VolumeError.
void readDicomPixels(const DicomSlice& slice, std::int16_t* hu);

/// The same for a slice of labels.
void readDicomPixels(const DicomSlice& slice, std::uint16_t* labels);

}  // namespace xray_registration

#include "xray_registration/volume/volume_io.h"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "dicom_series.h"
#include "file_boundary.h"
#include "itk_image_file.h"
#include "segment_layers.h"

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFilesInFolder = 50000;

VolumeGrid toVolumeGrid(const FileGrid& file) {
  VolumeGrid grid;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    grid.size[i] = file.size[axis];
    grid.spacing_mm[i] = file.spacing_mm[axis];
    grid.origin_ct_mm[i] = file.origin_mm[axis];
    grid.direction.col(i) = Eigen::Vector3d(file.axes[axis].data());
  }
  return grid;
}

FileGrid toFileGrid(const VolumeGrid& grid) {
  FileGrid file;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    file.size[axis] = grid.size[i];
    file.spacing_mm[axis] = grid.spacing_mm[i];
    file.origin_mm[axis] = grid.origin_ct_mm[i];
    for (int j = 0; j < 3; ++j) file.axes[axis][static_cast<std::size_t>(j)] = grid.direction(j, i);
  }
  return file;
}

std::vector<std::string> filesBelow(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && entry != end; entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_regular_file(ignored)) files.push_back(entry->path().string());
    if (files.size() > kMaxFilesInFolder) {
      throw VolumeError("'" + folder + "': it holds more than " + std::to_string(kMaxFilesInFolder) +
                        " files; name the folder of one study");
    }
  }
  if (error) throw VolumeError("'" + folder + "': it cannot be listed: " + error.message());
  std::sort(files.begin(), files.end());
  return files;
}

DicomSeriesMap seriesBelow(const std::string& folder) {
  DicomSeriesMap series;
  for (const std::string& file : filesBelow(folder)) {
    if (auto slice = readDicomHeader(file)) series[slice->series_uid].push_back(std::move(*slice));
  }
  return series;
}

std::string listOf(const DicomSeriesMap& series) {
  std::ostringstream text;
  const char* divider = "";
  for (const auto& [uid, slices] : series) {
    text << divider << uid << " (" << slices.size() << (slices.size() == 1 ? " slice)" : " slices)");
    divider = ", ";
  }
  return text.str();
}

const std::vector<DicomSlice>& chosenSeries(const DicomSeriesMap& series, const std::string& uid,
                                            const std::string& folder, const Logger& logger) {
  if (series.empty()) throw VolumeError("'" + folder + "': no DICOM image lies in this folder");
  if (!uid.empty()) {
    const auto found = series.find(uid);
    if (found != series.end()) return found->second;
    throw VolumeError("'" + folder + "': ct/series_uid '" + uid + "' is not there; there are: " + listOf(series));
  }
  const auto largest = std::max_element(series.begin(), series.end(),
                                        [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  if (series.size() > 1) {
    log(logger, LogLevel::kInfo,
        "The DICOM folder holds several series: " + listOf(series) + ". Taken: " + largest->first +
            ", the largest; ct/series_uid takes another");
  }
  return largest->second;
}

template <typename T>
FileImage<T> readFolder(const std::string& folder, const VolumeReadOptions& options, const Logger& logger) {
  const DicomSeriesMap series = seriesBelow(folder);
  const DicomStack stack = stackedSlices(chosenSeries(series, options.series_uid, folder, logger), folder);
  const std::string& modality = stack.slices.front().modality;
  if (modality != "CT") {
    log(logger, LogLevel::kWarning,
        "The DICOM series states the modality '" + modality + "', not CT: its values may not be Hounsfield units");
  }
  FileImage<T> image;
  image.grid = stack.grid;
  const std::size_t slice_size = static_cast<std::size_t>(stack.grid.size[0]) * stack.grid.size[1];
  image.voxels.resize(slice_size * stack.slices.size());
  for (std::size_t i = 0; i < stack.slices.size(); ++i) {
    readDicomPixels(stack.slices[i], image.voxels.data() + i * slice_size);
  }
  return image;
}

// "head" of "/data/head.nii.gz".
std::string nameOf(const std::string& path) {
  fs::path name = fs::path(path).filename();
  if (name.empty()) name = fs::path(path).parent_path().filename();
  if (fs::is_directory(path)) return name.string();
  if (name.extension() == ".gz") name = name.stem();
  return name.stem().string();
}

void logVolume(const std::string& kind, const std::string& name, const VolumeGrid& grid, const Logger& logger) {
  std::ostringstream text;
  text << kind << " '" << name << "': " << grid.size.x() << "x" << grid.size.y() << "x" << grid.size.z()
       << " voxels of " << grid.spacing_mm.x() << "x" << grid.spacing_mm.y() << "x" << grid.spacing_mm.z() << " mm";
  log(logger, LogLevel::kInfo, text.str());
}

}  // namespace

Volume readVolume(const std::string& path, const VolumeReadOptions& options, const Logger& logger) {
  const std::string real = checkedPath(path, options.directory);
  FileImage<std::int16_t> image =
      fs::is_directory(real) ? readFolder<std::int16_t>(real, options, logger) : readHuFile(real);
  Volume volume;
  volume.grid = toVolumeGrid(image.grid);
  volume.hu = std::move(image.voxels);
  volume.name = nameOf(path);
  logVolume("CT", volume.name, volume.grid, logger);
  return volume;
}

LabelVolume readLabels(const std::string& path, const VolumeReadOptions& options, const Logger& logger) {
  const std::string real = checkedPath(path, options.directory);
  checkLayers(real);
  FileImage<std::uint16_t> image =
      fs::is_directory(real) ? readFolder<std::uint16_t>(real, options, logger) : readLabelFile(real);
  LabelVolume labels;
  labels.grid = toVolumeGrid(image.grid);
  labels.labels = std::move(image.voxels);
  logVolume("Labels", nameOf(path), labels.grid, logger);
  return labels;
}

void writeVolume(const Volume& volume, const std::string& path) {
  if (volume.hu.empty() || volume.hu.size() != volume.grid.voxelCount()) {
    throw VolumeError("'" + path + "': the volume is empty or does not fit its grid, it is not written");
  }
  writeHuFile(toFileGrid(volume.grid), volume.hu, path);
}

std::vector<SeriesInfo> listDicomSeries(const std::string& folder) {
  std::vector<SeriesInfo> list;
  for (const auto& [uid, slices] : seriesBelow(checkedPath(folder, ""))) list.push_back({uid, slices.size()});
  return list;
}

}  // namespace xray_registration

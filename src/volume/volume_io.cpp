#include "xray_registration/volume/volume_io.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <sstream>
#include <type_traits>

#include "dicom_series.h"
#include "file_boundary.h"
#include "file_grid.h"
#include "header_text.h"
#include "hu_check.h"
#include "itk_image_file.h"
#include "nifti_file.h"
#include "padding.h"
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

DicomSeriesMap seriesBelow(const std::string& folder, const Logger& logger) {
  DicomSeriesMap series;
  std::vector<std::string> damaged;
  for (const std::string& file : filesBelow(folder)) {
    bool is_damaged = false;
    if (auto slice = readDicomHeader(file, &is_damaged)) series[slice->series_uid].push_back(std::move(*slice));
    if (is_damaged) damaged.push_back(fs::path(file).filename().string());
  }
  if (!damaged.empty()) {
    log(logger, LogLevel::kWarning,
        "'" + folder + "': " + std::to_string(damaged.size()) +
            " of its DICOM files are cut off, damaged or deflated and left out, the first of them " + damaged.front());
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

// What the slices say of their values beside the numbers.
void warnOfValues(const DicomSlice& slice, std::vector<std::string>* warnings) {
  if (slice.modality != "CT") {
    warnings->push_back("the DICOM series states the modality '" + onOneLine(slice.modality) +
                        "', not CT: its values may not be Hounsfield units");
  }
  if (!slice.rescale_type.empty() && slice.rescale_type != "HU") {
    warnings->push_back("the DICOM series states '" + onOneLine(slice.rescale_type) +
                        "' as the kind of its values, not HU: they may not be Hounsfield units");
  }
}

template <typename T>
FileImage<T> readFolder(const std::string& folder, const VolumeReadOptions& options, const FileRule& rule,
                        const Logger& logger) {
  const DicomSeriesMap series = seriesBelow(folder, logger);
  std::vector<DicomSlice> slices = chosenSeries(series, options.series_uid, folder, logger);
  FileImage<T> image;
  if (const std::size_t sharing = dropCopies(&slices)) {
    image.warnings.push_back(std::to_string(sharing) +
                             " of its slices have the instance UID of another one, though they are others; all are "
                             "taken, by their positions");
  }
  const DicomStack stack = stackedSlices(std::move(slices), folder);
  warnOfValues(stack.slices.front(), &image.warnings);
  image.format = "DICOM series " + onOneLine(stack.slices.front().series_uid);
  image.grid = stack.grid;
  checkGrid(image.grid, folder);
  scaleLengths(rule.unit_mm > 0.0 ? rule.unit_mm : 1.0, folder, &image.grid);
  const std::size_t slice_size = static_cast<std::size_t>(stack.grid.size[0]) * stack.grid.size[1];
  image.voxels.resize(slice_size * stack.slices.size());
  for (std::size_t i = 0; i < stack.slices.size(); ++i) {
    readDicomPixels(stack.slices[i], rule, image.voxels.data() + i * slice_size, &image.facts);
  }
  return image;
}

// One DICOM file. Its refusal says what to name instead.
void refuseDicomFile(const std::string& path) {
  bool is_damaged = false;
  const auto slice = readDicomHeader(path, &is_damaged);
  if (is_damaged && lowerCase(fs::path(path).extension().string()) == ".dcm") {
    throw VolumeError("'" + path + "': it is a DICOM file that is cut off, damaged or deflated");
  }
  if (!slice) return;
  throw VolumeError("'" + path + "': " +
                    (slice->frames > 1
                         ? "it holds several frames (enhanced DICOM), whose places are not checked; "
                           "convert it to single-frame DICOM or NIfTI"
                         : "it holds a single slice; a CT volume has several (for DICOM, name the folder)"));
}

// HU as they are, lengths and axes as the caller says.
FileRule ruleForLabels(const VolumeReadOptions& options) {
  if (!options.orientation.empty()) checkOrientation(options.orientation);
  FileRule rule;
  rule.unit_mm = options.unit_mm;
  rule.orientation = options.orientation;
  rule.directory = options.directory;
  return rule;
}

FileRule ruleForHu(const VolumeReadOptions& options) {
  FileRule rule = ruleForLabels(options);
  rule.slope = options.hu_slope;
  rule.intercept = options.hu_intercept;
  rule.padding = options.padding;
  return rule;
}

FileImage<std::int16_t> readHu(const std::string& real, const VolumeReadOptions& options, const FileRule& rule,
                               const Logger& logger) {
  if (fs::is_directory(real)) return readFolder<std::int16_t>(real, options, rule, logger);
  if (isNifti(real)) return readNiftiHu(real, rule);
  refuseDicomFile(real);
  return readHuFile(real, rule);
}

FileImage<std::uint16_t> readLabelImage(const std::string& real, const VolumeReadOptions& options,
                                        const Logger& logger) {
  const FileRule rule = ruleForLabels(options);
  if (fs::is_directory(real)) return readFolder<std::uint16_t>(real, options, rule, logger);
  if (isNifti(real)) return readNiftiLabels(real, rule);
  refuseDicomFile(real);
  return readLabelFile(real, rule);
}

template <typename T>
void warnOfFile(const FileImage<T>& image, const std::string& path, const Logger& logger) {
  const std::string file = "'" + path + "': ";
  for (const std::string& warning : image.warnings) log(logger, LogLevel::kWarning, file + warning);
  if (image.facts.not_finite > 0) {
    log(logger, LogLevel::kWarning,
        "'" + path + "': " + std::to_string(image.facts.not_finite) +
            " of its voxels hold no finite number, taken as " +
            (std::is_same<T, std::int16_t>::value ? "air" : "background"));
  }
}

// Numbers that no label has say that another image was named.
void checkLabels(const FileImage<std::uint16_t>& image, const std::string& path) {
  constexpr double kLargestLabel = std::numeric_limits<std::uint16_t>::max();
  if (!(image.facts.low <= image.facts.high)) {
    throw VolumeError("'" + path + "': none of its voxels holds a number: it is damaged, or no label image");
  }
  constexpr double kAir = -900.0;  // -1 and the like mark the background for some.
  if (image.facts.low > kAir && image.facts.high <= kLargestLabel) return;
  std::ostringstream text;
  text << "'" << path << "': its values run from " << image.facts.low << " to " << image.facts.high
       << "; labels are whole numbers from 0 to 65535. Is it the CT, or are other voxels marked by a number?";
  throw VolumeError(text.str());
}

void clearEdgePadding(const std::string& path, const Logger& logger, FileImage<std::int16_t>* image) {
  const auto padding = densePaddingAtEdges(image->voxels, image->grid.size);
  if (!padding) return;
  const std::size_t rows =
      static_cast<std::size_t>(image->grid.size[1]) * static_cast<std::size_t>(image->grid.size[2]);
  const std::size_t cleared = clearPadding(*padding, *padding, image->grid.size[0], rows, image->voxels.data());
  image->facts.padded += cleared;
  log(logger, LogLevel::kWarning,
      "'" + path + "': " + std::to_string(cleared) + " voxels around what was scanned hold " +
          std::to_string(*padding) + " HU, which is padding and taken as air");
}

void judgeValues(const FileImage<std::int16_t>& image, const FileRule& rule, const VolumeReadOptions& options,
                 const std::string& path, const Logger& logger) {
  const HuDoubt doubt = doubtAbout(image, rule);
  if (doubt.what.empty()) return;
  if (doubt.is_sure && options.check_values) throw VolumeError("'" + path + "': " + doubt.what);
  log(logger, LogLevel::kWarning, "'" + path + "': " + doubt.what);
}

// "head" of "/data/head.nii.gz".
std::string nameOf(const std::string& path) {
  fs::path name = fs::path(path).filename();
  if (name.empty()) name = fs::path(path).parent_path().filename();
  if (fs::is_directory(path)) return name.string();
  if (name.extension() == ".gz") name = name.stem();
  return name.stem().string();
}

template <typename T>
void logVolume(const std::string& kind, const std::string& name, const FileImage<T>& image, const Logger& logger) {
  const FileGrid& grid = image.grid;
  std::ostringstream text;
  text << kind << " '" << name << "': " << grid.size[0] << "x" << grid.size[1] << "x" << grid.size[2] << " voxels of "
       << grid.spacing_mm[0] << "x" << grid.spacing_mm[1] << "x" << grid.spacing_mm[2] << " mm; " << image.format
       << "; values in the file " << image.facts.low << " to " << image.facts.high;
  if (image.facts.padded > 0) text << "; " << image.facts.padded << " voxels are padding, taken as air";
  log(logger, LogLevel::kInfo, text.str());
}

}  // namespace

Volume readVolume(const std::string& path, const VolumeReadOptions& options, const Logger& logger) {
  const std::string real = checkedPath(path, options.directory);
  const FileRule rule = ruleForHu(options);
  FileImage<std::int16_t> image = readHu(real, options, rule, logger);
  warnOfFile(image, path, logger);
  clearEdgePadding(path, logger, &image);
  judgeValues(image, rule, options, path, logger);
  Volume volume;
  volume.grid = toVolumeGrid(image.grid);
  volume.name = nameOf(path);
  logVolume("CT", volume.name, image, logger);
  volume.hu = std::move(image.voxels);
  return volume;
}

LabelVolume readLabels(const std::string& path, const VolumeReadOptions& options, const Logger& logger) {
  const std::string real = checkedPath(path, options.directory);
  checkLayers(real);
  FileImage<std::uint16_t> image = readLabelImage(real, options, logger);
  checkLabels(image, path);
  warnOfFile(image, path, logger);
  LabelVolume labels;
  labels.grid = toVolumeGrid(image.grid);
  logVolume("Labels", nameOf(path), image, logger);
  labels.labels = std::move(image.voxels);
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
  for (const auto& [uid, slices] : seriesBelow(checkedPath(folder, ""), {})) list.push_back({uid, slices.size()});
  return list;
}

}  // namespace xray_registration

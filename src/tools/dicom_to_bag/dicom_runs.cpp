#include "tools/dicom_to_bag/dicom_runs.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace xray_registration::tools {
namespace {

namespace fs = std::filesystem;

struct ReadFile {
  std::string path;
  XrayDicomFile file;
};

std::vector<std::string> filesBelow(const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& entry : fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied)) {
    if (entry.is_regular_file() && looksLikeDicom(entry.path().string())) paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

void readFolder(const std::string& folder, const Logger& logger, std::vector<ReadFile>* files) {
  const std::size_t before = files->size();
  std::string last_problem;
  for (const std::string& path : filesBelow(folder)) {
    try {
      files->push_back({path, XrayDicomFile(path)});
    } catch (const XrayDicomError& error) {
      last_problem = error.what();
      log(logger, LogLevel::kWarning, "passed over: " + last_problem);
    }
  }
  if (files->size() > before) return;
  throw XrayDicomError("'" + folder + "': it holds no X-ray in DICOM" +
                       (last_problem.empty() ? std::string() : "; the last that was tried: " + last_problem));
}

bool isSame(const std::optional<double>& a, const std::optional<double>& b, double tolerance) {
  if (!a || !b) return a.has_value() == b.has_value();
  return std::abs(*a - *b) <= tolerance;
}

/// Whether two single pictures are of one series and from the same place.
bool belongTogether(const DicomHeader& a, const DicomHeader& b) {
  if (a.frames.size() != 1 || b.frames.size() != 1 || a.series.empty() || a.series != b.series) return false;
  if (a.width != b.width || a.height != b.height || a.bits != b.bits || a.photometric != b.photometric) return false;
  const DicomFrame& one = a.frames.front();
  const DicomFrame& other = b.frames.front();
  // Encoders of C-arms report tenths of a degree and whole millimetres.
  return isSame(one.primary_deg, other.primary_deg, 0.2) && isSame(one.secondary_deg, other.secondary_deg, 0.2) &&
         isSame(one.source_detector_mm, other.source_detector_mm, 2.0) && !one.vendor && !other.vendor;
}

void sortByNumber(DicomRun* run) {
  std::vector<std::size_t> order(run->files.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [run](std::size_t a, std::size_t b) {
    return run->files[a].header().number.value_or(0.0) < run->files[b].header().number.value_or(0.0);
  });
  std::vector<XrayDicomFile> files;
  std::vector<std::string> paths;
  for (const std::size_t index : order) {
    files.push_back(std::move(run->files[index]));
    paths.push_back(run->paths[index]);
  }
  run->files = std::move(files);
  run->paths = std::move(paths);
}

/// Times of single pictures by the clock of the device; false when it does not tell them apart.
bool setTimesByClock(DicomRun* run) {
  for (std::size_t i = 0; i < run->files.size(); ++i) {
    const auto clock = run->files[i].header().clock_s;
    const auto first = run->files.front().header().clock_s;
    if (!clock || !first) return false;
    run->pictures[i].time_s = *clock - *first;
    if (i > 0 && run->pictures[i].time_s <= run->pictures[i - 1].time_s) return false;
  }
  return true;
}

void setPictures(double period_s, DicomRun* run) {
  const auto& frames = run->files.front().header().frames;
  if (run->files.size() == 1) {
    for (std::size_t i = 0; i < frames.size(); ++i) run->pictures.push_back({0, i, frames[i].time_s});
    run->times_are_known = frames.size() == 1 || !run->header().time_source.empty();
  } else {
    sortByNumber(run);
    for (std::size_t i = 0; i < run->files.size(); ++i) run->pictures.push_back({i, 0, 0.0});
    run->times_are_known = setTimesByClock(run);
  }
  if (run->times_are_known) return;
  for (std::size_t i = 0; i < run->pictures.size(); ++i) run->pictures[i].time_s = static_cast<double>(i) * period_s;
}

}  // namespace

std::vector<DicomRun> readDicomRuns(const std::vector<std::string>& inputs, double period_s, const Logger& logger) {
  std::vector<ReadFile> files;
  for (const std::string& input : inputs) {
    if (fs::is_directory(input)) {
      readFolder(input, logger, &files);
    } else {
      files.push_back({input, XrayDicomFile(input)});
    }
  }
  std::vector<DicomRun> runs;
  for (ReadFile& read : files) {
    const auto same = std::find_if(runs.begin(), runs.end(), [&read](const DicomRun& run) {
      return belongTogether(run.header(), read.file.header());
    });
    DicomRun& run = same == runs.end() ? runs.emplace_back() : *same;
    run.paths.push_back(read.path);
    run.files.push_back(std::move(read.file));
  }
  for (DicomRun& run : runs) setPictures(period_s, &run);
  return runs;
}

}  // namespace xray_registration::tools

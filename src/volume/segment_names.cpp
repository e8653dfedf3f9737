#include "xray_registration/volume/segment_names.h"

#include <algorithm>
#include <fstream>
#include <optional>
#include <set>

#include "file_boundary.h"
#include "segment_layers.h"
#include "xray_registration/volume/volume_error.h"

// 3D Slicer's keys in the header of an NRRD: Segment<i>_Name:=..., Segment<i>_LabelValue:=..., Segment<i>_Layer:=...
// ("Segmentation file format" of its documentation). Versions before layers had one volume per segment and no label
// values.

namespace xray_registration {
namespace {

constexpr int kMaxHeaderLines = 100000;
constexpr std::size_t kMaxLineLength = 1U << 20U;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

struct Segment {
  std::string name;
  std::string label;
  std::string layer;
};

struct Segmentation {
  std::map<int, Segment> segments;
  bool has_list_axis = false;  // One volume per layer, or per segment in files before layers.
};

// Lines of an NRRD's header; none for another file.
std::vector<std::string> headerLines(const std::string& path) {
  std::vector<std::string> lines;
  std::ifstream stream(path, std::ios::binary);
  std::string line;
  if (!std::getline(stream, line) || line.rfind("NRRD", 0) != 0) return lines;
  while (lines.size() < kMaxHeaderLines && std::getline(stream, line) && line.size() < kMaxLineLength) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) break;
    lines.push_back(line);
  }
  return lines;
}

// A whole number of up to six digits; std::regex takes a frame of the stack for each character of a line.
std::optional<int> shortNumber(const std::string& digits) {
  const bool is_number = !digits.empty() && digits.size() <= 6 &&
                         std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  return is_number ? std::optional<int>(std::stoi(digits)) : std::nullopt;
}

struct SegmentField {
  int segment = 0;
  std::string key;  // Name, LabelValue or Layer.
  std::string value;
};

// "Segment3_Name:=T12"; nothing for another line.
std::optional<SegmentField> segmentField(const std::string& line) {
  const std::string begin = "Segment";
  const std::size_t divider = line.find('_');
  const std::size_t assignment = line.find(":=");
  if (line.rfind(begin, 0) != 0 || assignment == std::string::npos || divider > assignment) return std::nullopt;
  const auto segment = shortNumber(line.substr(begin.size(), divider - begin.size()));
  const std::string key = line.substr(divider + 1, assignment - divider - 1);
  if (!segment || (key != "Name" && key != "LabelValue" && key != "Layer")) return std::nullopt;
  return SegmentField{*segment, key, line.substr(assignment + 2)};
}

Segmentation readHeader(const std::string& path) {
  Segmentation result;
  for (const std::string& line : headerLines(path)) {
    if (line.rfind("kinds:", 0) == 0 && line.find("list") != std::string::npos) result.has_list_axis = true;
    if (const auto field = segmentField(line)) {
      Segment& segment = result.segments[field->segment];
      (field->key == "Name" ? segment.name : field->key == "Layer" ? segment.layer : segment.label) = field->value;
    }
  }
  return result;
}

std::size_t layersOf(const Segmentation& segmentation) {
  std::set<std::string> layers;
  for (const auto& [index, segment] : segmentation.segments) layers.insert(segment.layer);
  return layers.size();
}

int labelOf(const Segment& segment, const std::string& path) {
  const auto label = shortNumber(segment.label);
  if (!label) {
    refuse(path, "segment '" + segment.name + "' has the label value '" + segment.label + "', which is no number");
  }
  return *label;
}

Segmentation checkedHeader(const std::string& path) {
  Segmentation segmentation = readHeader(path);
  if (segmentation.segments.empty()) return segmentation;
  if (layersOf(segmentation) > 1 || (segmentation.has_list_axis && segmentation.segments.size() > 1)) {
    refuse(path,
           "its segments overlap, so 3D Slicer saved them in layers; a voxel must have one label: export them as a "
           "label map (Segmentations, Export to files, NRRD or NIfTI), or let no segments overlap (Segment Editor, "
           "Masking, Modify other segments: Overwrite all) and save again");
  }
  return segmentation;
}

}  // namespace

void checkLayers(const std::string& path) { checkedHeader(path); }

std::map<std::string, int> segmentNames(const std::string& path, const std::string& directory) {
  const Segmentation segmentation = checkedHeader(checkedPath(path, directory));
  std::map<std::string, int> names;
  for (const auto& [index, segment] : segmentation.segments) {
    if (segment.name.empty() || segment.label.empty()) continue;
    if (!names.emplace(segment.name, labelOf(segment, path)).second) {
      refuse(path, "two of its segments are called '" + segment.name + "'; give each a name of its own");
    }
  }
  return names;
}

std::vector<int> labelsNamed(const std::vector<std::string>& names, const std::string& path,
                             const std::string& directory) {
  const std::map<std::string, int> known = segmentNames(path, directory);
  std::vector<int> labels;
  for (const std::string& name : names) {
    const auto found = known.find(name);
    if (found != known.end()) {
      labels.push_back(found->second);
      continue;
    }
    std::string there;
    for (const auto& [other, label] : known) there += (there.empty() ? "" : ", ") + other;
    refuse(path, "no segment is called '" + name + "'; " +
                     (known.empty() ? "the file has no names of segments, give the labels as numbers"
                                    : "there are: " + there));
  }
  return labels;
}

}  // namespace xray_registration

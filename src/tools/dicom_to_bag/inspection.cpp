#include "tools/dicom_to_bag/inspection.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "tools/common/json_files.h"
#include "xray_registration/common/escaped.h"

namespace xray_registration::tools {
namespace {

std::string formatted(const char* format, double a, double b = 0.0) {
  std::array<char, 80> text{};
  std::snprintf(text.data(), text.size(), format, a, b);
  return text.data();
}

void printRow(const char* what, const std::string& value, const std::string& source) {
  std::printf("  %-20s %-24s %s\n", what, value.c_str(), source.c_str());
}

template <typename T, typename Words>
void printStated(const char* what, const Stated<T>& stated, const Words& words) {
  if (!stated.value) return printRow(what, "-", "not stated");
  printRow(what, words(*stated.value), stated.source + (stated.estimate ? " (estimate)" : ""));
}

std::string sideOf(double degrees, const char* above, const char* below) {
  const char* side = degrees > 0.0 ? above : degrees < 0.0 ? below : "";
  return formatted("%.6g deg ", degrees) + side;
}

void printHeader(const DicomView& view) {
  const DicomRun& run = *view.run;
  const DicomHeader& header = run.header();
  const std::string file = escaped(std::filesystem::path(run.paths.front()).filename().string());
  const std::string more = run.files.size() > 1 ? " and " + std::to_string(run.files.size() - 1) + " more" : "";
  std::printf("%s%s: %s, %zu %s of %d x %d px, %d bits, %s%s\n", file.c_str(), more.c_str(),
              header.modality.empty() ? "no modality" : header.modality.c_str(), run.pictures.size(),
              run.pictures.size() == 1 ? "picture" : "pictures", header.width, header.height, header.bits,
              header.transfer_syntax.c_str(), header.lossy ? ", compressed with losses" : "");
}

void printTimes(const DicomView& view) {
  const DicomRun& run = *view.run;
  if (run.pictures.size() < 2) return;
  const double last_s = run.pictures.back().time_s;
  const std::string source = !run.times_are_known               ? "not stated: --frame-rate"
                             : run.header().time_source.empty() ? "times of acquisition"
                                                                : run.header().time_source;
  printRow("pictures", formatted("in %.4g s, %.4g a second", last_s, (run.pictures.size() - 1) / last_s), source);
}

void printMask(const DicomView& view) {
  if (view.mask.empty()) return printRow("shutters", "none", "");
  const auto seen = std::count(view.mask.pixels.begin(), view.mask.pixels.end(), 255);
  printRow("shutters", formatted("%.1f %% is seen", 100.0 * static_cast<double>(seen) / view.mask.pixels.size()),
           "shutter (0018,16xx), collimator (0018,17xx)");
}

void printPixels(const DicomView& view) {
  printRow("image/kind", nameOf(view.kind), view.meaning.in_words + (view.meaning.assumed ? " (assumed)" : ""));
  if (view.run->header().has_window) printRow("window, LUT", "not applied", "they are for displays");
}

void printGeometry(const DicomGeometry& geometry) {
  const auto mm = [](double value) { return formatted("%.6g mm", value); };
  printStated("source to detector", geometry.source_detector_mm, mm);
  printStated("source to isocentre", geometry.source_isocentre_mm, mm);
  printStated("pixel", geometry.pixel_mm,
              [](const RowColumn& size) { return formatted("%.6g x %.6g mm", size[0], size[1]); });
  printStated("principal point", geometry.principal_point_px,
              [](const Eigen::Vector2d& point) { return formatted("%.2f, %.2f px", point.x(), point.y()); });
  printStated("primary angle", geometry.primary_deg, [](double value) { return sideOf(value, "LAO", "RAO"); });
  printStated("secondary angle", geometry.secondary_deg, [](double value) { return sideOf(value, "CRA", "CAU"); });
  printStated("mirrored", geometry.mirrored,
              [](bool mirrored) { return std::string(mirrored ? "yes: columns reversed" : "no"); });
  if (geometry.camera) {
    const XrayCamera& camera = *geometry.camera;
    printRow("camera", formatted("fx %.2f, fy %.2f px", camera.fx, camera.fy),
             formatted("cx %.2f, cy %.2f px in the bag", camera.cx, camera.cy));
  }
  printRow("first pose", geometry.T_camera_isocentre ? "yes" : "no", "");
}

void printMissing(const std::string& where, const MissingGeometry& one) {
  std::printf("  missing%s: %s; give %s\n", where.c_str(), one.what.c_str(), one.remedy.c_str());
}

/// Of the first picture, or else of the first one that lacks something.
void printMissing(const DicomView& view) {
  const DicomGeometry& geometry = view.geometry();
  const std::optional<std::size_t> other = incompletePicture(view);
  for (const MissingGeometry& one : geometry.missing) printMissing(one.for_pose ? " (for a first pose)" : "", one);
  if (geometry.missing.empty() && other) {
    for (const MissingGeometry& one : view.geometries[*other].missing) {
      printMissing(" in picture " + std::to_string(*other + 1) + (one.for_pose ? " (for a first pose)" : ""), one);
    }
  } else if (geometry.missing.empty()) {
    std::printf("  nothing is missing\n");
  }
  for (const std::string& warning : geometry.warnings) std::printf("  warning: %s\n", warning.c_str());
}

template <typename T>
nlohmann::json orNull(const Stated<T>& stated) {
  return stated.value ? nlohmann::json(*stated.value) : nlohmann::json();
}

nlohmann::json missingJson(const DicomGeometry& geometry) {
  nlohmann::json all = nlohmann::json::array();
  for (const MissingGeometry& one : geometry.missing) {
    all.push_back({{"what", one.what}, {"option", one.remedy}, {"for_pose", one.for_pose}});
  }
  return all;
}

nlohmann::json sourcesJson(const DicomGeometry& geometry) {
  return {{"source_detector_mm", geometry.source_detector_mm.source},
          {"source_patient_mm", geometry.source_isocentre_mm.source},
          {"pixel_mm", geometry.pixel_mm.source},
          {"principal_point_px", geometry.principal_point_px.source},
          {"primary_deg", geometry.primary_deg.source},
          {"secondary_deg", geometry.secondary_deg.source},
          {"mirrored", geometry.mirrored.source}};
}

}  // namespace

void printInspection(const DicomView& view) {
  printHeader(view);
  printPixels(view);
  printTimes(view);
  printMask(view);
  printGeometry(view.geometry());
  printMissing(view);
}

nlohmann::json inspectionJson(const DicomView& view) {
  const DicomGeometry& geometry = view.geometry();
  const DicomHeader& header = view.run->header();
  nlohmann::json json = {{"modality", header.modality},
                         {"pictures", view.run->pictures.size()},
                         {"width", header.width},
                         {"height", header.height},
                         {"bits", header.bits},
                         {"transfer_syntax", header.transfer_syntax},
                         {"patient_position", header.patient_position},
                         {"kind", nameOf(view.kind)},
                         {"kind_in_words", view.meaning.in_words},
                         {"source_detector_mm", orNull(geometry.source_detector_mm)},
                         {"source_patient_mm", orNull(geometry.source_isocentre_mm)},
                         {"pixel_mm", orNull(geometry.pixel_mm)},
                         {"primary_deg", orNull(geometry.primary_deg)},
                         {"secondary_deg", orNull(geometry.secondary_deg)},
                         {"mirrored", *geometry.mirrored.value},
                         {"sources", sourcesJson(geometry)},
                         {"missing", missingJson(geometry)},
                         {"warnings", geometry.warnings}};
  json["principal_point_px"] = nullptr;
  if (const auto& point = geometry.principal_point_px.value) json["principal_point_px"] = {point->x(), point->y()};
  json["camera"] = nullptr;
  if (const auto& camera = geometry.camera) {
    json["camera"] = {{"fx", camera->fx}, {"fy", camera->fy}, {"cx", camera->cx}, {"cy", camera->cy}};
  }
  json["T_camera_isocentre"] = nullptr;
  if (geometry.T_camera_isocentre) json["T_camera_isocentre"] = toJson(*geometry.T_camera_isocentre);
  return json;
}

}  // namespace xray_registration::tools

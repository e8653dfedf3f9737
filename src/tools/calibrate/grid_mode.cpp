#include "tools/calibrate/grid_mode.h"

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tools/calibrate/grid_picture.h"
#include "tools/common/json_files.h"
#include "xray_registration/image/calibration_grid.h"
#include "xray_registration/image/undistortion_map.h"
#include "xray_registration/image/xray_image_file.h"

namespace xray_registration::tools {
namespace {

namespace fs = std::filesystem;

const char* nameOf(GridKind kind) { return kind == GridKind::kSquare ? "square" : "hexagonal"; }

CalibrationGrid gridIn(const FloatImage& picture, const std::string& path) {
  try {
    return findCalibrationGrid(picture);
  } catch (const GridError& error) {
    throw std::runtime_error("'" + path + "': " + error.what());
  }
}

std::vector<PixelPair> pairsOf(const CalibrationGrid& grid) {
  std::vector<PixelPair> pairs;
  for (const GridMark& mark : grid.marks) pairs.push_back({mark.raw, mark.straight});
  return pairs;
}

std::string makeFolder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder)) throw std::runtime_error(folder + ": the folder cannot be made: " + error.message());
  return folder;
}

double knownShare(const UndistortionMap& map) {
  int known = 0;
  for (int v = 0; v < map.height(); ++v) {
    for (int u = 0; u < map.width(); ++u) known += map.covers({u, v}) ? 1 : 0;
  }
  return static_cast<double>(known) / map.width() / map.height();
}

void print(const GridCalibration& found, const GridArguments& arguments) {
  const UndistortionFit& fit = found.fit;
  std::printf("%s: %s grid of %zu %s marks, %.3f px apart in the middle of %d x %d px\n", arguments.image.c_str(),
              nameOf(found.grid.kind), found.grid.marks.size(), found.grid.bright_marks ? "bright" : "dark",
              found.grid.pitch_px, found.map.width(), found.map.height());
  std::printf("distortion before: rms %6.3f px, largest %6.3f px\n", fit.before.rms_px, fit.before.max_px);
  std::printf("           after: rms %6.3f px, largest %6.3f px; rms %.3f px at marks that were held back\n",
              fit.after.rms_px, fit.after.max_px, fit.cross_validated_rms_px);
  std::printf(
      "%d marks used, %zu left out that contradict them; polynomial of degree %d; known in %.0f %% of the picture\n",
      fit.points_used, found.grid.marks.size() - static_cast<std::size_t>(fit.points_used), found.map.degree(),
      100.0 * knownShare(found.map));
  if (arguments.spacing_mm > 0.0) {
    std::printf("a pixel is %.5f mm at the grid\n", arguments.spacing_mm / found.grid.pitch_px);
  }
}

nlohmann::json toJson(const PixelResidual& residual) {
  return {{"rms_px", residual.rms_px}, {"max_px", residual.max_px}};
}

nlohmann::json report(const GridCalibration& found, const GridArguments& arguments) {
  nlohmann::json grid = {{"image", fs::path(arguments.image).filename().string()},
                         {"image_width", found.map.width()},
                         {"image_height", found.map.height()},
                         {"kind", nameOf(found.grid.kind)},
                         {"bright_marks", found.grid.bright_marks},
                         {"pitch_px", found.grid.pitch_px},
                         {"marks", found.grid.marks.size()},
                         {"filled_share", found.grid.filled_share},
                         {"used", found.fit.points_used},
                         {"degree", found.map.degree()},
                         {"known_share", knownShare(found.map)},
                         {"before", toJson(found.fit.before)},
                         {"after", toJson(found.fit.after)},
                         {"cross_validated_rms_px", found.fit.cross_validated_rms_px}};
  if (arguments.spacing_mm > 0.0) grid["pixel_mm"] = arguments.spacing_mm / found.grid.pitch_px;
  return {{"grid", grid}};
}

}  // namespace

void calibrateFromGrid(const GridArguments& arguments) {
  const FloatImage picture = floatsOf(readXrayImage(arguments.image).pixels);
  CalibrationGrid grid = gridIn(picture, arguments.image);
  UndistortionFit fit;
  UndistortionMap map = UndistortionMap::fitted(picture.width, picture.height, pairsOf(grid), &fit);
  const GridCalibration found{std::move(grid), std::move(map), std::move(fit)};
  const fs::path folder = makeFolder(arguments.output);
  const std::string map_file = (folder / "undistortion_map.yaml").string();
  const std::string picture_file = (folder / "grid.png").string();
  found.map.write(map_file);
  drawGrid(picture_file, picture, found);
  if (!arguments.json.empty()) writeJson(arguments.json, report(found, arguments));
  print(found, arguments);
  std::printf("written: %s (for the parameter image/undistortion_map), %s\n", map_file.c_str(), picture_file.c_str());
}

}  // namespace xray_registration::tools

#include "tools/landmarks/slicer_markups.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "tools/landmarks/csv_table.h"

namespace xray_registration::tools {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

/// What the coordinates of the first two axes are to be multiplied with. Old files have numbers for the names.
double signToLps(const std::string& path, const std::string& system) {
  if (system == "LPS" || system == "1") return 1.0;
  if (system == "RAS" || system == "0") return -1.0;
  refuse(path, system.empty() ? "does not state its coordinate system (LPS or RAS); save it with a current 3D Slicer"
                              : "its coordinate system is '" + system + "'; LPS and RAS are read");
}

Eigen::Vector3d inLps(double sign, double x, double y, double z) { return {sign * x, sign * y, z}; }

std::optional<double> numberIn(const std::string& text) {
  std::size_t used = 0;
  try {
    const double value = std::stod(text, &used);
    if (used == text.size() && std::isfinite(value)) return value;
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return std::nullopt;
}

/// "u, v" or "u, v, view"; any other description is just that.
std::vector<PointPixel> pixelsIn(const std::string& description) {
  const auto cells = csvCells(description);
  if (cells.size() < 2 || cells.size() > 3) return {};
  const auto u = numberIn(cells[0]), v = numberIn(cells[1]);
  if (!u || !v) return {};
  return {{cells.size() == 3 ? cells[2] : "", Eigen::Vector2d(*u, *v)}};
}

/// Adds a pixel to the point of the same name, or the point.
void add(const FilePoint& point, std::vector<FilePoint>* points) {
  for (FilePoint& known : *points) {
    if (point.name.empty() || known.name != point.name || point.pixels.empty()) continue;
    known.pixels.insert(known.pixels.end(), point.pixels.begin(), point.pixels.end());
    return;
  }
  points->push_back(point);
}

void addMarkup(const std::string& path, const nlohmann::json& markup, std::vector<FilePoint>* points) {
  const auto system = markup.value("coordinateSystem", nlohmann::json(""));
  const double sign = signToLps(path, system.is_string() ? system.get<std::string>() : system.dump());
  const std::string units = markup.value("coordinateUnits", std::string("mm"));
  if (units != "mm") refuse(path, "its coordinates are in '" + units + "'; millimetres are read");
  for (const auto& control : markup.at("controlPoints")) {
    if (control.value("positionStatus", std::string("defined")) != "defined") continue;
    const auto position = control.at("position").get<std::vector<double>>();
    if (position.size() != 3)
      refuse(path, "a position has " + std::to_string(position.size()) + " numbers instead of 3");
    FilePoint point;
    point.name = control.value("label", std::string());
    point.point_ct = inLps(sign, position[0], position[1], position[2]);
    point.pixels = pixelsIn(control.value("description", std::string()));
    add(point, points);
  }
}

}  // namespace

std::vector<FilePoint> readMarkupsJson(const std::string& path) {
  std::ifstream stream(path);
  if (!stream) refuse(path, "cannot be read");
  std::vector<FilePoint> points;
  try {
    const nlohmann::json json = nlohmann::json::parse(stream);
    for (const auto& markup : json.at("markups")) addMarkup(path, markup, &points);
  } catch (const nlohmann::json::exception& error) {
    refuse(path, std::string("is no markups file of 3D Slicer: ") + error.what());
  }
  return points;
}

std::vector<FilePoint> readMarkupsFcsv(const std::string& path) {
  std::ifstream stream(path);
  if (!stream) refuse(path, "cannot be read");
  std::string system;
  std::vector<std::string> columns = {"id", "x", "y", "z"};
  std::vector<FilePoint> points;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const auto equals = line.find('=');
    if (!line.empty() && line.front() == '#') {
      if (line.find("CoordinateSystem") != std::string::npos && equals != std::string::npos) {
        system = csvCells(line.substr(equals + 1)).front();
      } else if (line.find("columns") != std::string::npos && equals != std::string::npos) {
        columns = csvCells(line.substr(equals + 1));
      }
      continue;
    }
    if (line.empty()) continue;
    const double sign = signToLps(path, system);
    const auto cells = csvCells(line);
    const auto cell = [&](const char* name) {
      for (std::size_t i = 0; i < columns.size() && i < cells.size(); ++i) {
        if (columns[i] == name) return cells[i];
      }
      return std::string();
    };
    const auto x = numberIn(cell("x")), y = numberIn(cell("y")), z = numberIn(cell("z"));
    if (!x || !y || !z) refuse(path, "line " + std::to_string(number) + " has no three coordinates");
    FilePoint point{cell("label"), inLps(sign, *x, *y, *z), pixelsIn(cell("desc"))};
    add(point, &points);
  }
  return points;
}

}  // namespace xray_registration::tools

#include "tools/landmarks/points_file.h"

#include <algorithm>
#include <stdexcept>

#include "tools/landmarks/csv_table.h"
#include "tools/landmarks/slicer_markups.h"

namespace xray_registration::tools {
namespace {

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

[[noreturn]] void refuseWithout(const std::string& path, const std::string& column) {
  throw std::runtime_error(path + ": has no column " + column + "; the first line names the columns (docs/formats.md)");
}

void requireColumns(const std::string& path, const CsvTable& table, const std::vector<std::string>& columns) {
  for (const std::string& column : columns) {
    if (!table.has(column)) refuseWithout(path, column);
  }
}

PointPixel pixelOf(const CsvTable& table, std::size_t row) {
  return {table.text(row, "view"), {table.number(row, "u_px"), table.number(row, "v_px")}};
}

std::vector<FilePoint> readTable(const std::string& path) {
  const CsvTable table(path);
  requireColumns(path, table, {"x_mm", "y_mm", "z_mm"});
  const bool has_pixels = table.has("u_px") || table.has("v_px");
  if (has_pixels) requireColumns(path, table, {"u_px", "v_px"});
  std::vector<FilePoint> points;
  points.reserve(table.rows());
  for (std::size_t row = 0; row < table.rows(); ++row) {
    FilePoint point;
    point.name = table.text(row, "name");
    point.point_ct = {table.number(row, "x_mm"), table.number(row, "y_mm"), table.number(row, "z_mm")};
    if (has_pixels) point.pixels = {pixelOf(table, row)};
    points.push_back(point);
  }
  return points;
}

}  // namespace

std::vector<FilePoint> readPointsFile(const std::string& path) {
  std::vector<FilePoint> points;
  if (endsWith(path, ".json")) {
    points = readMarkupsJson(path);
  } else if (endsWith(path, ".fcsv")) {
    points = readMarkupsFcsv(path);
  } else {
    points = readTable(path);
  }
  if (points.empty()) throw std::runtime_error(path + ": holds no point");
  return points;
}

std::map<std::string, std::vector<PointPixel>> readPixelsFile(const std::string& path) {
  const CsvTable table(path);
  requireColumns(path, table, {"name", "u_px", "v_px"});
  std::map<std::string, std::vector<PointPixel>> pixels;
  for (std::size_t row = 0; row < table.rows(); ++row) pixels[table.text(row, "name")].push_back(pixelOf(table, row));
  return pixels;
}

}  // namespace xray_registration::tools

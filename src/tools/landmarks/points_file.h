#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace xray_registration::tools {

/// Where a view shows a point.
struct PointPixel {
  std::string view;  ///< Empty: the only one.
  Eigen::Vector2d pixel;
};

/// A point of the CT as a file has it, LPS, mm, and its pixels if the file has those too.
struct FilePoint {
  std::string name;
  Eigen::Vector3d point_ct;
  std::vector<PointPixel> pixels;
};

/// Reads points of a CT (docs/formats.md): a table (.csv) with their pixels, or markups of 3D Slicer (.mrk.json,
/// .fcsv), whose header says whether they are LPS or RAS; of those, pixels may stand in the description, as "u, v" or
/// "u, v, view". One line of a table is one pixel; lines with one name are one point in several views.
/// @throws std::runtime_error naming the file, the line or point, and what is wrong: no header, no coordinate system,
/// units that are not millimetres, a cell that is no number.
std::vector<FilePoint> readPointsFile(const std::string& path);

/// Reads pixels by the points' names, .csv: name, u_px, v_px and perhaps view.
/// @throws std::runtime_error as above.
std::map<std::string, std::vector<PointPixel>> readPixelsFile(const std::string& path);

}  // namespace xray_registration::tools

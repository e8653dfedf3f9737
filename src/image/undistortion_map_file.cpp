#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "image/polynomial_surface.h"
#include "xray_registration/common/yaml_file.h"
#include "xray_registration/image/undistortion_map.h"

namespace xray_registration {
namespace {

constexpr char kFormat[] = "xray_registration undistortion map 1";
constexpr int kLargestSide = 100000;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw UndistortionMapError("'" + path + "': " + what);
}

// Not by cv::FileStorage, which wrote it: that does not survive all that can stand in a file. False when there is no
// such number.
template <typename T>
bool readNumber(const YAML::Node& node, T* value) {
  return node.IsDefined() && YAML::convert<T>::decode(node, *value);
}

int wholeNumber(const YAML::Node& file, const std::string& path, const std::string& key, int low, int high) {
  int value = 0;
  if (!readNumber(file[key], &value)) refuse(path, "'" + key + "' is missing or not a whole number");
  if (value < low || value > high) {
    refuse(path, "'" + key + "' is " + std::to_string(value) + "; allowed: " + std::to_string(low) + " to " +
                     std::to_string(high));
  }
  return value;
}

std::vector<double> numbers(const YAML::Node& file, const std::string& path, const std::string& key) {
  const YAML::Node node = file[key];
  if (!node.IsDefined() || !node.IsSequence()) refuse(path, "'" + key + "' is missing or not a list of numbers");
  std::vector<double> values;
  for (const auto& element : node) {
    double value = 0.0;
    if (!readNumber(element, &value)) {
      refuse(path, "'" + key + "' holds something that is not a number");
    }
    if (!std::isfinite(value)) refuse(path, "'" + key + "' holds a number that is not finite");
    values.push_back(value);
  }
  return values;
}

std::vector<double> numbers(const YAML::Node& file, const std::string& path, const std::string& key, int count) {
  std::vector<double> values = numbers(file, path, key);
  if (values.size() != static_cast<std::size_t>(count)) {
    refuse(path, "'" + key + "' has " + std::to_string(values.size()) + " numbers instead of " + std::to_string(count));
  }
  return values;
}

PolynomialSurface readSurface(const YAML::Node& file, const std::string& path) {
  PolynomialSurface surface;
  surface.degree = wholeNumber(file, path, "degree", 0, PolynomialSurface::kHighestDegree);
  const auto centre = numbers(file, path, "centre", 2);
  surface.centre = {centre[0], centre[1]};
  const bool has_scale = readNumber(file["scale"], &surface.scale);
  if (!has_scale || !std::isfinite(surface.scale) || surface.scale <= 0.0) {
    refuse(path, "'scale' is missing or not a positive number");
  }
  const int terms = PolynomialSurface::termCount(surface.degree);
  const auto u = numbers(file, path, "displacement_u", terms);
  const auto v = numbers(file, path, "displacement_v", terms);
  surface.coefficients.resize(terms, 2);
  surface.coefficients.col(0) = Eigen::Map<const Eigen::VectorXd>(u.data(), terms);
  surface.coefficients.col(1) = Eigen::Map<const Eigen::VectorXd>(v.data(), terms);
  return surface;
}

/// A hull's corners may be rounded: turns by less than this angle (rad) are none.
constexpr double kStraight = 1e-3;

bool isConvex(const std::vector<Eigen::Vector2d>& hull) {
  bool left = false;
  bool right = false;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d first = hull[(i + 1) % hull.size()] - hull[i];
    const Eigen::Vector2d second = hull[(i + 2) % hull.size()] - hull[(i + 1) % hull.size()];
    const double turn = (first.x() * second.y() - first.y() * second.x()) / (first.norm() * second.norm());
    left = left || turn > kStraight;
    right = right || turn < -kStraight;
  }
  return left != right;
}

std::vector<Eigen::Vector2d> readHull(const YAML::Node& file, const std::string& path) {
  const auto values = numbers(file, path, "hull");
  std::vector<Eigen::Vector2d> hull;
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) hull.emplace_back(values[i], values[i + 1]);
  if (hull.size() < 3 || values.size() % 2 != 0 || !isConvex(hull)) {
    refuse(path, "'hull' is not the corners u, v, u, v, … of a convex area");
  }
  return hull;
}

void writeNumbers(cv::FileStorage* file, const char* key, const std::vector<double>& values) {
  *file << key << "[:";
  for (const double value : values) *file << value;
  *file << "]";
}

std::vector<double> column(const PolynomialSurface& surface, int index) {
  const auto values = surface.coefficients.col(index);
  return std::vector<double>(values.data(), values.data() + values.size());
}

YAML::Node opened(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) refuse(path, "there is no such file");
  YAML::Node file;
  try {
    file = loadYaml(path);
  } catch (const std::runtime_error&) {
    file = YAML::Node();  // Refused below.
  }
  if (!file.IsMap() || !file["format"].IsDefined() || !file["format"].IsScalar() ||
      file["format"].Scalar() != kFormat) {
    refuse(path, "it is no undistortion map (calibrate --grid writes one)");
  }
  return file;
}

}  // namespace

UndistortionMap UndistortionMap::read(const std::string& path) {
  const YAML::Node file = opened(path);
  UndistortionMap map;
  map.width_ = wholeNumber(file, path, "image_width", 1, kLargestSide);
  map.height_ = wholeNumber(file, path, "image_height", 1, kLargestSide);
  map.displacement_ = std::make_shared<const PolynomialSurface>(readSurface(file, path));
  map.hull_ = readHull(file, path);
  return map;
}

void UndistortionMap::write(const std::string& path) const {
  // OpenCV prints an error of its own for a file that cannot be opened.
  if (!std::ofstream(path)) refuse(path, "it cannot be opened for writing");
  try {
    cv::FileStorage file(path, cv::FileStorage::WRITE | cv::FileStorage::FORMAT_YAML);
    file << "format" << kFormat << "image_width" << width_ << "image_height" << height_;
    file.writeComment("raw = straight + displacement, all in pixels; displacement_u = sum of c x^i y^j in the order");
    file.writeComment("1, x, y, x^2, x y, y^2, ... with x, y = (straight - centre) / scale");
    file << "degree" << displacement_->degree;
    writeNumbers(&file, "centre", {displacement_->centre.x(), displacement_->centre.y()});
    file << "scale" << displacement_->scale;
    writeNumbers(&file, "displacement_u", column(*displacement_, 0));
    writeNumbers(&file, "displacement_v", column(*displacement_, 1));
    file.writeComment("corners u, v, ... of the area where the map is known, straight pixels");
    std::vector<double> corners;
    for (const Eigen::Vector2d& corner : hull_) corners.insert(corners.end(), {corner.x(), corner.y()});
    writeNumbers(&file, "hull", corners);
  } catch (const cv::Exception& error) {
    refuse(path, std::string("it cannot be written: ") + error.what());
  }
  // OpenCV does not say when the disk is full.
  read(path);
}

}  // namespace xray_registration

#include "tools/common/yaml_files.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "xray_registration/common/yaml_file.h"
#include "xray_registration/pipeline/pose_yaml.h"

namespace xray_registration::tools {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

YAML::Node loadFile(const std::string& path) {
  YAML::Node node;
  try {
    node = loadYaml(path);
  } catch (const std::runtime_error& error) {
    refuse(path, error.what());
  }
  if (!node.IsMap()) refuse(path, "holds no keys");
  return node;
}

double number(const std::string& path, const YAML::Node& parent, const std::string& key) {
  const YAML::Node node = parent[key];
  if (!node) refuse(path, "'" + key + "' is missing");
  double value = 0.0;
  try {
    value = node.as<double>();
  } catch (const YAML::Exception&) {
    refuse(path, "'" + key + "' is not a number");
  }
  if (!std::isfinite(value)) refuse(path, "'" + key + "' is not finite");
  return value;
}

double numberOr(const std::string& path, const YAML::Node& parent, const std::string& key, double otherwise) {
  return parent[key] ? number(path, parent, key) : otherwise;
}

int wholeNumber(const std::string& path, const YAML::Node& parent, const std::string& key) {
  const double value = number(path, parent, key);
  if (value < 1.0 || value > 100000.0 || value != std::floor(value)) {
    refuse(path, "'" + key + "' must be a whole number from 1 to 100000");
  }
  return static_cast<int>(value);
}

XrayCamera calibratedCamera(const std::string& path, const YAML::Node& node) {
  XrayCamera camera;
  camera.width = wholeNumber(path, node, "image_width");
  camera.height = wholeNumber(path, node, "image_height");
  const auto k = numbersFromYaml(node["camera_matrix"]["data"], "camera_matrix/data", 9);
  if (k[1] != 0.0) refuse(path, "'camera_matrix' has skew, which no X-ray camera here may have");
  camera.fx = k[0];
  camera.cx = k[2];
  camera.fy = k[4];
  camera.cy = k[5];
  if (const auto distortion = node["distortion_coefficients"]; distortion && distortion["data"]) {
    for (const auto& value : distortion["data"]) {
      if (value.as<double>(0.0) != 0.0) {
        refuse(path, "'distortion_coefficients' are not zero; give the camera of the undistorted image");
      }
    }
  }
  return camera;
}

XrayCamera shortCamera(const std::string& path, const YAML::Node& node) {
  XrayCamera camera;
  camera.width = wholeNumber(path, node, "width");
  camera.height = wholeNumber(path, node, "height");
  if (node["source_detector_mm"]) {
    const double pixel_mm = number(path, node, "pixel_mm");
    if (pixel_mm <= 0.0) refuse(path, "'pixel_mm' must be above zero");
    camera.fx = number(path, node, "source_detector_mm") / pixel_mm;
    camera.fy = camera.fx;
  } else {
    camera.fx = number(path, node, "fx");
    camera.fy = numberOr(path, node, "fy", camera.fx);
  }
  camera.cx = numberOr(path, node, "cx", 0.5 * (camera.width - 1));
  camera.cy = numberOr(path, node, "cy", 0.5 * (camera.height - 1));
  return camera;
}

void writeText(const std::string& path, const std::string& text) {
  std::ofstream stream(path);
  stream << text << '\n';
  if (!stream.flush()) refuse(path, "cannot be written");
}

}  // namespace

XrayCamera readCameraFile(const std::string& path) {
  const YAML::Node node = loadFile(path);
  XrayCamera camera;
  try {
    camera = node["camera_matrix"] ? calibratedCamera(path, node) : shortCamera(path, node);
  } catch (const std::invalid_argument& error) {
    refuse(path, error.what());
  } catch (const YAML::Exception& error) {
    refuse(path, error.what());
  }
  const std::string problem = camera.problem();
  if (!problem.empty()) refuse(path, problem);
  return camera;
}

void writeCameraFile(const std::string& path, const std::string& camera_name, const XrayCamera& camera) {
  Calibration calibration;
  calibration.width = camera.width;
  calibration.height = camera.height;
  calibration.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  writeCameraFile(path, camera_name, calibration);
}

void writeCameraFile(const std::string& path, const std::string& camera_name, const Calibration& calibration) {
  const auto& k = calibration.k;
  const bool lens = !calibration.distortion.empty();
  const std::vector<double> distortion = lens ? calibration.distortion : std::vector<double>(5, 0.0);
  YAML::Emitter out;
  const auto matrix = [&out](const char* key, int rows, int cols, const std::vector<double>& data) {
    out << YAML::Key << key << YAML::Value << YAML::BeginMap;
    out << YAML::Key << "rows" << YAML::Value << rows << YAML::Key << "cols" << YAML::Value << cols;
    out << YAML::Key << "data" << YAML::Value << YAML::Flow << data << YAML::EndMap;
  };
  out.SetDoublePrecision(17);
  out << YAML::BeginMap;
  out << YAML::Key << "image_width" << YAML::Value << calibration.width;
  out << YAML::Key << "image_height" << YAML::Value << calibration.height;
  out << YAML::Key << "camera_name" << YAML::Value << camera_name;
  matrix("camera_matrix", 3, 3, {k.begin(), k.end()});
  out << YAML::Key << "distortion_model" << YAML::Value
      << (calibration.distortion_model.empty() ? "plumb_bob" : calibration.distortion_model);
  matrix("distortion_coefficients", 1, static_cast<int>(distortion.size()), distortion);
  matrix("rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  matrix("projection_matrix", 3, 4, {k[0], 0, k[2], 0, 0, k[4], k[5], 0, 0, 0, 1, 0});
  out << YAML::EndMap;
  writeText(path, out.c_str());
}

RigidTransform readPoseFile(const std::string& path) {
  const YAML::Node node = loadFile(path);
  try {
    return poseFromYaml(node["initial_pose"] ? node["initial_pose"] : node);
  } catch (const std::invalid_argument& error) {
    refuse(path, error.what());
  }
}

void writePoseFile(const std::string& path, const RigidTransform& T_camera_ct) {
  const Eigen::Vector3d p = T_camera_ct.translation() / 1000.0;
  const Eigen::Quaterniond q(T_camera_ct.linear());
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::BeginMap;
  out << YAML::Key << "position" << YAML::Value << YAML::Flow << std::vector<double>{p.x(), p.y(), p.z()};
  out << YAML::Key << "orientation" << YAML::Value << YAML::Flow << std::vector<double>{q.x(), q.y(), q.z(), q.w()};
  out << YAML::EndMap;
  writeText(path, out.c_str());
}

}  // namespace xray_registration::tools

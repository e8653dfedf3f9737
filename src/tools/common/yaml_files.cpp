#include "tools/common/yaml_files.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace xray_registration::tools {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

YAML::Node loadFile(const std::string& path) {
  YAML::Node node;
  try {
    node = YAML::LoadFile(path);
  } catch (const YAML::BadFile&) {
    refuse(path, "cannot be opened");
  } catch (const YAML::Exception& error) {
    refuse(path, std::string("is not YAML: ") + error.what());
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

/// Numbers in row order, from a list or a list of lists.
std::vector<double> numbers(const std::string& path, const YAML::Node& node, const std::string& key,
                            std::size_t count) {
  if (!node || !node.IsSequence()) refuse(path, "'" + key + "' must be a list");
  std::vector<double> values;
  try {
    for (const auto& entry : node) {
      if (!entry.IsSequence()) {
        values.push_back(entry.as<double>());
        continue;
      }
      for (const auto& inner : entry) values.push_back(inner.as<double>());
    }
  } catch (const YAML::Exception&) {
    refuse(path, "'" + key + "' must hold numbers alone");
  }
  if (values.size() != count) {
    refuse(path, "'" + key + "' must hold " + std::to_string(count) + " numbers, not " + std::to_string(values.size()));
  }
  for (const double value : values) {
    if (!std::isfinite(value)) refuse(path, "'" + key + "' holds a number that is not finite");
  }
  return values;
}

XrayCamera calibratedCamera(const std::string& path, const YAML::Node& node) {
  XrayCamera camera;
  camera.width = wholeNumber(path, node, "image_width");
  camera.height = wholeNumber(path, node, "image_height");
  const auto k =
      numbers(path, node["camera_matrix"] ? node["camera_matrix"]["data"] : YAML::Node(), "camera_matrix/data", 9);
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

RigidTransform poseFromMatrix(const std::string& path, const YAML::Node& node) {
  const auto values = numbers(path, node, "T_camera_ct_mm", 16);
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  try {
    return rigidFromMatrix(matrix);
  } catch (const std::invalid_argument& error) {
    refuse(path, std::string("'T_camera_ct_mm': ") + error.what());
  }
}

RigidTransform poseFromQuaternion(const std::string& path, const YAML::Node& node) {
  const auto position_m = numbers(path, node["position"], "position", 3);
  const auto q = numbers(path, node["orientation"], "orientation", 4);
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1.0) > 1e-2) {
    refuse(path, "'orientation' must be a unit quaternion x, y, z, w");
  }
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() = rotation.normalized().toRotationMatrix();
  T_camera_ct.translation() = 1000.0 * Eigen::Vector3d(position_m[0], position_m[1], position_m[2]);
  return T_camera_ct;
}

void writeText(const std::string& path, const std::string& text) {
  std::ofstream stream(path);
  stream << text << '\n';
  if (!stream.flush()) refuse(path, "cannot be written");
}

}  // namespace

XrayCamera readCameraFile(const std::string& path) {
  const YAML::Node node = loadFile(path);
  const XrayCamera camera = node["camera_matrix"] ? calibratedCamera(path, node) : shortCamera(path, node);
  const std::string problem = camera.problem();
  if (!problem.empty()) refuse(path, problem);
  return camera;
}

void writeCameraFile(const std::string& path, const std::string& camera_name, const XrayCamera& camera) {
  YAML::Emitter out;
  const auto matrix = [&out](const char* key, int rows, int cols, const std::vector<double>& data) {
    out << YAML::Key << key << YAML::Value << YAML::BeginMap;
    out << YAML::Key << "rows" << YAML::Value << rows << YAML::Key << "cols" << YAML::Value << cols;
    out << YAML::Key << "data" << YAML::Value << YAML::Flow << data << YAML::EndMap;
  };
  out.SetDoublePrecision(17);
  out << YAML::BeginMap;
  out << YAML::Key << "image_width" << YAML::Value << camera.width;
  out << YAML::Key << "image_height" << YAML::Value << camera.height;
  out << YAML::Key << "camera_name" << YAML::Value << camera_name;
  matrix("camera_matrix", 3, 3, {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1});
  out << YAML::Key << "distortion_model" << YAML::Value << "plumb_bob";
  matrix("distortion_coefficients", 1, 5, {0, 0, 0, 0, 0});
  matrix("rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  matrix("projection_matrix", 3, 4, {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0});
  out << YAML::EndMap;
  writeText(path, out.c_str());
}

RigidTransform readPoseFile(const std::string& path) {
  YAML::Node node = loadFile(path);
  if (node["initial_pose"]) node.reset(node["initial_pose"]);
  if (node["T_camera_ct_mm"]) return poseFromMatrix(path, node["T_camera_ct_mm"]);
  if (!node["position"]) refuse(path, "holds neither 'position' and 'orientation' nor 'T_camera_ct_mm'");
  return poseFromQuaternion(path, node);
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

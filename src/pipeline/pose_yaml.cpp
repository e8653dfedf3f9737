#include "xray_registration/pipeline/pose_yaml.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <stdexcept>

namespace xray_registration {

std::vector<double> numbersFromYaml(const YAML::Node& node, const std::string& key, std::size_t count) {
  if (!node.IsDefined() || !node.IsSequence()) throw std::invalid_argument("'" + key + "' must be a list");
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
    throw std::invalid_argument("'" + key + "' must hold numbers alone");
  }
  if (values.size() != count) {
    throw std::invalid_argument("'" + key + "' must hold " + std::to_string(count) + " numbers, not " +
                                std::to_string(values.size()));
  }
  for (const double value : values) {
    if (!std::isfinite(value)) throw std::invalid_argument("'" + key + "' holds a number that is not finite");
  }
  return values;
}

RigidTransform poseFromYaml(const YAML::Node& node) {
  if (!node.IsMap()) throw std::invalid_argument("a pose has keys");
  if (node["T_camera_ct_mm"]) {
    if (node["position"] || node["orientation"]) {
      throw std::invalid_argument("'T_camera_ct_mm' stands beside 'position' or 'orientation'");
    }
    const auto values = numbersFromYaml(node["T_camera_ct_mm"], "T_camera_ct_mm", 16);
    try {
      return rigidFromMatrix(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data()));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(std::string("'T_camera_ct_mm': ") + error.what());
    }
  }
  const auto position_m = numbersFromYaml(node["position"], "position", 3);
  const auto q = numbersFromYaml(node["orientation"], "orientation", 4);
  try {
    return rigidFromQuaternion(1000.0 * Eigen::Vector3d(position_m[0], position_m[1], position_m[2]),
                               Eigen::Quaterniond(q[3], q[0], q[1], q[2]));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("the pose ") + error.what());
  }
}

}  // namespace xray_registration

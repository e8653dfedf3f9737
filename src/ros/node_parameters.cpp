#include "xray_registration/ros/node_parameters.h"

#include <ros/node_handle.h>
#include <yaml-cpp/yaml.h>

namespace xray_registration {

namespace {

YAML::Node toYaml(XmlRpc::XmlRpcValue value) {  // By value: XmlRpcValue's accessors are not const.
  YAML::Node node;
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeStruct:
      node = YAML::Node(YAML::NodeType::Map);
      for (auto& [name, member] : value) node[name] = toYaml(member);
      return node;
    case XmlRpc::XmlRpcValue::TypeArray:
      node = YAML::Node(YAML::NodeType::Sequence);
      for (int i = 0; i < value.size(); ++i) node.push_back(toYaml(value[i]));
      return node;
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return YAML::Node(static_cast<bool>(value));
    case XmlRpc::XmlRpcValue::TypeInt:
      return YAML::Node(static_cast<int>(value));
    case XmlRpc::XmlRpcValue::TypeDouble:
      return YAML::Node(static_cast<double>(value));
    case XmlRpc::XmlRpcValue::TypeString:
      return YAML::Node(static_cast<std::string>(value));
    default:
      return node;
  }
}

}  // namespace

NodeParameters loadParameters(const ros::NodeHandle& private_node, const Logger& logger) {
  XmlRpc::XmlRpcValue tree;
  if (!private_node.getParam(private_node.getNamespace(), tree) || tree.getType() != XmlRpc::XmlRpcValue::TypeStruct) {
    return NodeParameters{};
  }
  return parseParameters(toYaml(tree), logger);
}

}  // namespace xray_registration

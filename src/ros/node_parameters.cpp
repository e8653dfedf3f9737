#include "xray_registration/ros/node_parameters.h"

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>
#include <yaml-cpp/yaml.h>

#include <string>

namespace xray_registration {

namespace {

YAML::Node toYaml(XmlRpc::XmlRpcValue value, const std::string& name) {  // By value: its accessors are not const.
  YAML::Node node;
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeStruct:
      node = YAML::Node(YAML::NodeType::Map);
      for (auto& [key, member] : value) {
        std::string path = name;
        if (!path.empty()) path += '/';
        node[key] = toYaml(member, path += key);
      }
      return node;
    case XmlRpc::XmlRpcValue::TypeArray:
      node = YAML::Node(YAML::NodeType::Sequence);
      for (int i = 0; i < value.size(); ++i) node.push_back(toYaml(value[i], name));
      return node;
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return YAML::Node(static_cast<bool>(value));
    case XmlRpc::XmlRpcValue::TypeInt:
      return YAML::Node(static_cast<int>(value));
    case XmlRpc::XmlRpcValue::TypeDouble:
      return YAML::Node(static_cast<double>(value));
    case XmlRpc::XmlRpcValue::TypeString:
      return YAML::Node(static_cast<std::string>(value));
    case XmlRpc::XmlRpcValue::TypeInvalid:
      return node;
    default:
      throw ParameterError("parameter " + name + " is '" + value.toXml() +
                           "'; allowed: numbers, texts, true or false, lists and groups of them; a text that looks "
                           "like a date needs quotes");
  }
}

/// A transport that is not there would only be missed when subscribing, by an exception of pluginlib's.
void checkImageTransport(const ros::NodeHandle& node, const std::string& wanted) {
  const std::string package = "image_transport/";
  std::string allowed;
  for (const std::string& lookup_name : image_transport::ImageTransport(node).getLoadableTransports()) {
    if (lookup_name.rfind(package, 0) != 0) continue;
    const std::string transport = lookup_name.substr(package.size());
    if (transport == wanted) return;
    allowed += (allowed.empty() ? "" : ", ") + transport;
  }
  throw ParameterError("parameter image_transport is '" + wanted + "'; allowed here: " + allowed);
}

}  // namespace

NodeParameters loadParameters(const ros::NodeHandle& private_node, const Logger& logger) {
  NodeParameters parameters;
  XmlRpc::XmlRpcValue tree;
  if (private_node.getParam(private_node.getNamespace(), tree)) parameters = parseParameters(toYaml(tree, ""), logger);
  checkImageTransport(private_node, parameters.image_transport);
  return parameters;
}

}  // namespace xray_registration

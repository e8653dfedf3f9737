#pragma once

#include "xray_registration/pipeline/parameters.h"

namespace ros {
class NodeHandle;
}

namespace xray_registration {

/// Reads what is below the node's private name, as parseParameters does from YAML, and checks that the transport of
/// images can be loaded.
/// @throws ParameterError
NodeParameters loadParameters(const ros::NodeHandle& private_node, const Logger& logger = {});

}  // namespace xray_registration

#pragma once

#include <yaml-cpp/yaml.h>

#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/pipeline/body_parameters.h"

namespace xray_registration {

struct NodeParameters;

/// The list `bodies` of a tree of parameters.
/// @throws ParameterError naming `bodies[i]/…`, counted from 0.
std::vector<BodyParameters> readBodies(const YAML::Node& tree, const Logger& logger);

/// What holds between bodies, and between them and the other parameters.
/// @throws ParameterError
void validateBodies(const NodeParameters& parameters);

}  // namespace xray_registration

#pragma once

#include <string>

namespace YAML {
class Node;
}

namespace xray_registration {

/// Reads a YAML file of parameters, a camera or a pose.
/// @throws std::runtime_error that says what is wrong, without the file's name: it cannot be opened, is larger than
/// 1 MiB, is no YAML, or checkYaml() refuses it. Any thread.
YAML::Node loadYaml(const std::string& path);

/// The same of a text.
YAML::Node parseYaml(const std::string& text);

/// Refuses what would take more memory or stack than there is once somebody goes through it: aliases (*name) count as
/// often as they stand there, so that a few lines can hold millions of values, or themselves.
/// @throws std::runtime_error for more than 100 000 values or a depth of more than 50.
void checkYaml(const YAML::Node& node);

}  // namespace xray_registration

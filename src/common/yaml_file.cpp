#include "xray_registration/common/yaml_file.h"

#include <yaml-cpp/yaml.h>

#include <array>
#include <fstream>
#include <stdexcept>

namespace xray_registration {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 20;
constexpr int kMostValues = 100000;
constexpr int kDeepest = 50;

std::string contentOf(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot be opened");
  std::string text;
  std::array<char, 4096> part{};
  do {
    stream.read(part.data(), part.size());
    text.append(part.data(), static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kLargestFile) throw std::runtime_error("is larger than 1 MiB, which no such file is");
  } while (stream);
  if (stream.bad()) throw std::runtime_error("cannot be read");
  return text;
}

void count(const YAML::Node& node, int depth, int* values) {
  if (++*values > kMostValues) {
    throw std::runtime_error("holds more than " + std::to_string(kMostValues) +
                             " values, each as often as an alias (*name) repeats it");
  }
  if (depth > kDeepest) {
    throw std::runtime_error("has lists or groups in each other more than " + std::to_string(kDeepest) + " deep");
  }
  if (!node.IsMap() && !node.IsSequence()) return;
  for (const auto& child : node) {
    if (node.IsMap()) count(child.first, depth + 1, values);
    count(node.IsMap() ? child.second : child, depth + 1, values);
  }
}

}  // namespace

YAML::Node loadYaml(const std::string& path) { return parseYaml(contentOf(path)); }

YAML::Node parseYaml(const std::string& text) {
  YAML::Node node;
  try {
    node = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(std::string("is not YAML: ") + error.what());
  }
  checkYaml(node);
  return node;
}

void checkYaml(const YAML::Node& node) {
  int values = 0;
  count(node, 0, &values);
}

}  // namespace xray_registration

#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "xray_registration/pipeline/parameters.h"

namespace xray_registration {

inline void setFlow(YAML::Node node) {
  if (!node.IsMap() && !node.IsSequence()) return;
  node.SetStyle(YAML::EmitterStyle::Flow);
  for (const auto& child : node) setFlow(node.IsMap() ? child.second : child);
}

/// A value as a message shows it: on one line, however it was written.
inline std::string shown(const YAML::Node& value) {
  const YAML::Node flow = YAML::Clone(value);
  setFlow(flow);
  return flow.IsScalar() ? flow.Scalar() : YAML::Dump(flow);
}

/// One group of parameters (`accept/…`) being read: checks types and ranges with messages that name the parameter, and
/// remembers which names are known. A value that is not given keeps what the target holds.
class ParameterGroup {
 public:
  /// `group`: the name below `parent`, or "" for `parent` itself; `outer`: what stands before it in messages.
  ParameterGroup(const YAML::Node& parent, const std::string& group, const std::string& outer = "")
      : prefix_(group.empty() ? "" : outer + group + "/"), node_(group.empty() ? parent : childOf(parent, group)) {
    if (node_.IsDefined() && !node_.IsNull() && !node_.IsMap()) {
      const std::string name = group.empty() ? "(all)" : outer + group;
      throw ParameterError("parameter " + name + " is '" + shown(node_) + "'; allowed: a group of parameters");
    }
  }

  /// An entry of a list; `place`: what messages call it.
  ParameterGroup(const std::string& place, const YAML::Node& entry) : prefix_(place + "/"), node_(entry) {
    if (!node_.IsMap()) {
      throw ParameterError("parameter " + place + " is '" + shown(node_) + "'; allowed: a group of parameters");
    }
  }

  void number(const std::string& name, double low, double high, double* value) {
    const std::string allowed = "a number from " + text(low) + " to " + text(high);
    readInto(name, allowed, value);
    if (!(*value >= low && *value <= high)) fail(name, text(*value), allowed);
  }

  void integer(const std::string& name, int low, int high, int* value) {
    const std::string allowed = "a whole number from " + std::to_string(low) + " to " + std::to_string(high);
    readInto(name, allowed, value);
    if (*value < low || *value > high) fail(name, std::to_string(*value), allowed);
  }

  void flag(const std::string& name, bool* value) { readInto(name, "true or false", value); }

  void words(const std::string& name, std::string* value) { readInto(name, "a text", value); }

  void list(const std::string& name, std::vector<std::string>* value) { readInto(name, "a list of names", value); }

  template <typename T>
  void choice(const std::string& name, const std::vector<std::pair<std::string, T>>& choices, T* value) {
    std::string allowed;
    for (const auto& [word, unused] : choices) allowed += (allowed.empty() ? "one of " : ", ") + word;
    const YAML::Node given = known(name);
    if (!isGiven(given)) return;
    std::string word;
    readInto(name, allowed, &word);
    for (const auto& [candidate, meaning] : choices) {
      if (candidate == word) {
        *value = meaning;
        return;
      }
    }
    fail(name, shown(given), allowed);
  }

  /// A value that the caller reads itself; undefined when not given.
  YAML::Node known(const std::string& name) {
    known_.insert(name);
    return childOf(node_, name);
  }
  static bool isGiven(const YAML::Node& node) { return node.IsDefined() && !node.IsNull(); }

  /// What stands in the group and is not known: names as in messages, and values.
  std::vector<std::pair<std::string, std::string>> unknown() const {
    std::vector<std::pair<std::string, std::string>> found;
    if (!node_.IsDefined() || !node_.IsMap()) return found;
    for (const auto& entry : node_) {
      const std::string name = shown(entry.first);
      if (known_.count(name) == 0) found.emplace_back(prefix_ + name, shown(entry.second));
    }
    return found;
  }

  void refuseUnknown() const {
    const auto unknown_ones = unknown();
    if (unknown_ones.empty()) return;
    const auto& [name, value] = *unknown_ones.begin();
    std::string allowed;
    for (const std::string& other : known_) allowed += (allowed.empty() ? "" : ", ") + other;
    throw ParameterError("parameter " + name + " ('" + value + "') is not known; allowed below " + prefix_ + ": " +
                         allowed);
  }

  [[noreturn]] void fail(const std::string& name, const std::string& value, const std::string& allowed) const {
    throw ParameterError("parameter " + prefix_ + name + " is '" + value + "'; allowed: " + allowed);
  }

 private:
  // yaml-cpp's operator[] on a missing node throws or creates; this does neither.
  static YAML::Node childOf(const YAML::Node& parent, const std::string& name) {
    if (!parent.IsDefined() || !parent.IsMap()) return YAML::Node(YAML::NodeType::Undefined);
    return parent[name];
  }

  template <typename T>
  void readInto(const std::string& name, const std::string& allowed, T* value) {
    const YAML::Node given = known(name);
    if (!isGiven(given)) return;
    try {
      *value = given.as<T>();
    } catch (const YAML::Exception&) {
      fail(name, shown(given), allowed);
    }
  }

  static std::string text(double value) {
    std::ostringstream stream;
    stream << value;
    return stream.str();
  }

  std::string prefix_;
  YAML::Node node_;
  std::set<std::string> known_;
};

}  // namespace xray_registration

// What the code allows each parameter to be, asked of the code itself: every name of a configuration file is given a
// value that none can have, and the refusal says what is allowed. Prints JSON for scripts/parameters.
// usage: parameter_facts config/default.yaml
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "xray_registration/pipeline/parameters.h"

namespace xray_registration {
namespace {

struct Fact {
  std::string name;
  std::string allowed;
  std::string value;
};

/// A configuration that holds `value` at `name` (a/b), and nothing else.
YAML::Node withOnly(const std::string& name, const YAML::Node& value) {
  YAML::Node tree(YAML::NodeType::Map);
  const std::size_t slash = name.find('/');
  if (slash == std::string::npos) {
    tree[name] = value;
  } else {
    tree[name.substr(0, slash)] = withOnly(name.substr(slash + 1), value);
  }
  return tree;
}

/// Why a configuration is refused; empty when it is not.
std::string refusal(const YAML::Node& tree) {
  try {
    parseParameters(tree);
    return "";
  } catch (const ParameterError& error) {
    return error.what();
  }
}

std::string behind(const std::string& words, const std::string& text) {
  const std::size_t at = text.find(words);
  return at == std::string::npos ? "" : text.substr(at + words.size());
}

/// A list within a list within a list is no parameter's value.
YAML::Node nonsense() { return YAML::Load("[[{}]]"); }

std::string allowed(const std::string& name) { return behind("; allowed: ", refusal(withOnly(name, nonsense()))); }

std::string allowedOfBody(const std::string& name) {
  YAML::Node body = YAML::Load("{name: x, mesh: x.stl}");
  if (name == "ct" || name == "label" || name == "labels") body.remove("mesh");
  body[name] = nonsense();
  YAML::Node tree;
  tree["bodies"].push_back(body);
  return behind("; allowed: ", refusal(tree));
}

std::vector<std::string> split(const std::string& names) {
  std::vector<std::string> found;
  for (std::size_t at = 0; at < names.size();) {
    const std::size_t end = std::min(names.find(", ", at), names.size());
    found.push_back(names.substr(at, end - at));
    at = end + 2;
  }
  return found;
}

/// The names that a group knows.
std::vector<std::string> namesBelow(const std::string& group) {
  return split(behind(" is not known; allowed below " + group + "/: ",
                      refusal(withOnly(group + "/no_such_name", YAML::Node(1)))));
}

std::string flow(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter.SetMapFormat(YAML::Flow);
  emitter.SetSeqFormat(YAML::Flow);
  emitter << node;
  return emitter.c_str();
}

std::string quoted(const std::string& text) {
  YAML::Emitter emitter;
  emitter.SetOutputCharset(YAML::EscapeNonAscii);
  emitter << YAML::DoubleQuoted << text;
  return emitter.c_str();
}

void print(const std::vector<Fact>& facts) {
  std::cout << "[\n";
  for (std::size_t i = 0; i < facts.size(); ++i) {
    std::cout << R"({"name": )" << quoted(facts[i].name) << R"(, "allowed": )" << quoted(facts[i].allowed)
              << R"(, "default": )" << quoted(facts[i].value) << (i + 1 < facts.size() ? "},\n" : "}\n");
  }
  std::cout << "]\n";
}

/// Of the file's values; below `groups`, also of what the code knows and the file does not have.
std::vector<Fact> factsOf(const YAML::Node& file) {
  std::vector<Fact> facts;
  for (const auto& entry : file) {
    const auto name = entry.first.as<std::string>();
    if (!entry.second.IsMap()) {
      facts.push_back({name, allowed(name), flow(entry.second)});
      continue;
    }
    for (const std::string& member : namesBelow(name)) {
      const YAML::Node value = entry.second[member];
      facts.push_back({name + "/" + member, allowed(name + "/" + member), value ? flow(value) : ""});
    }
  }
  const std::string refused = refusal(YAML::Load("bodies: [{name: x, mesh: x.stl, no_such_name: 1}]"));
  for (const std::string& member : split(behind("allowed below bodies[0]/: ", refused))) {
    facts.push_back({"bodies[]/" + member, allowedOfBody(member), ""});
  }
  return facts;
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: parameter_facts config/default.yaml\n";
    return 2;
  }
  try {
    xray_registration::print(xray_registration::factsOf(YAML::LoadFile(argv[1])));
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "parameter_facts: " << error.what() << '\n';
    return 1;
  }
}

#include "xray_registration/common/yaml_file.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <fstream>

namespace xray_registration {
namespace {

std::string refusal(const std::string& text) {
  try {
    parseYaml(text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

void expectContains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

TEST(YamlFile, AliasesAreReadAsOftenAsTheyStandThere) {
  const YAML::Node node = parseYaml("first: &p [1, 2]\nsecond: *p\n");
  EXPECT_EQ(node["second"][1].as<int>(), 2);
}

// A few hundred bytes that hold 10⁹ values once they are written out.
TEST(YamlFile, ABombOfAliasesIsRefused) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before;
    for (int j = 0; j < 9; ++j) bomb += ", " + before;
    bomb += "]\n";
  }
  expectContains(refusal(bomb), "more than 100000 values");
}

TEST(YamlFile, WhatHoldsItselfIsRefused) {
  expectContains(refusal("a: &a [*a]"), "deep");
  expectContains(refusal("a: &a {b: *a}"), "deep");
}

TEST(YamlFile, DepthIsLimited) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_EQ(refusal(nested(40)), "");
  expectContains(refusal(nested(60)), "50 deep");
  EXPECT_NE(refusal(nested(100000)), "");  // The library's own limit.
}

TEST(YamlFile, OnlySmallFilesAreRead) {
  const std::string path = testing::TempDir() + "yaml_file_test.yaml";
  std::ofstream(path) << "a: " << std::string(std::size_t{1} << 20U, 'x');
  try {
    loadYaml(path);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    expectContains(error.what(), "larger than 1 MiB");
  }
  EXPECT_THROW(loadYaml("/nowhere/a.yaml"), std::runtime_error);
  EXPECT_THROW(loadYaml(testing::TempDir()), std::runtime_error);
}

}  // namespace
}  // namespace xray_registration

// A file of a pose.
#include <yaml-cpp/yaml.h>

#include <stdexcept>

#include "test/fuzz/fuzz_target.h"
#include "tools/common/yaml_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const std::string path = fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "pose.yaml");
  try {
    const RigidTransform pose = tools::readPoseFile(path);
    fuzz::require(pose.matrix().allFinite(), "a pose is finite");
    // A matrix in a file has rounded numbers, which are taken as they are.
    fuzz::require((pose.linear().transpose() * pose.linear()).isIdentity(0.05), "a pose is rigid");
  } catch (const YAML::Exception&) {
    fuzz::require(false, "no error of the library's comes through");
  } catch (const std::runtime_error& error) {
    fuzz::require(error.what()[0] != '\0', "a refusal has words");
  }
  return 0;
}

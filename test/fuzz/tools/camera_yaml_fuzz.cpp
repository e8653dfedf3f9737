// A file of a camera.
#include <yaml-cpp/yaml.h>

#include <stdexcept>

#include "test/fuzz/fuzz_target.h"
#include "tools/common/yaml_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const std::string path = fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "camera.yaml");
  try {
    const XrayCamera camera = tools::readCameraFile(path);
    fuzz::require(std::string(camera.problem()).empty(), "a camera that is read is usable");
    tools::writeCameraFile(path, "camera", camera);
    fuzz::require(tools::readCameraFile(path) == camera, "a camera comes back as it was written");
  } catch (const YAML::Exception&) {
    fuzz::require(false, "no error of the library's comes through");
  } catch (const std::runtime_error& error) {
    fuzz::require(error.what()[0] != '\0', "a refusal has words");
  }
  return 0;
}

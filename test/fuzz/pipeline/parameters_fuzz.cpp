// A file of parameters.
#include <yaml-cpp/yaml.h>

#include "test/fuzz/fuzz_target.h"
#include "xray_registration/pipeline/parameters.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const std::string path = fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "parameters.yaml");
  try {
    const NodeParameters parameters =
        loadParametersYaml(path, [](LogLevel, const std::string& text) { fuzz::requireWords(text); });
    fuzz::require(!parameters.frames.ct.empty() && !parameters.viewNames().empty(), "parameters are validated");
  } catch (const ParameterError& error) {
    fuzz::requireWords(error.what());
  }
  return 0;
}

// A bag as a recorded session.
#include "test/fuzz/fuzz_target.h"
#include "xray_registration/common/names.h"
#include "xray_registration/ros/bag_session.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const std::string path = fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "session.bag");
  try {
    const BagSession session(path, {}, [](LogLevel, const std::string& text) { fuzz::requireWords(text); });
    for (const BagView& view : session.views()) {
      fuzz::require(view.name.empty() || isNamePath(view.name), "a view's name may be part of a file's name");
    }
    for (std::size_t i = 0; i < session.frameCount(); ++i) session.frame(i);
  } catch (const BagSessionError& error) {
    fuzz::requireWords(error.what());
  }
  return 0;
}

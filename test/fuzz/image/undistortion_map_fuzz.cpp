// The file of an undistortion map, and an image that is straightened with it.
#include <cmath>
#include <memory>

#include "test/fuzz/fuzz_target.h"
#include "xray_registration/image/undistortion_map.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration::fuzz {
namespace {

void straighten(const std::shared_ptr<const UndistortionMap>& map) {
  constexpr int kLargestSide = 64;
  if (map->width() > kLargestSide || map->height() > kLargestSide) return;
  FloatImage image(map->width(), map->height());
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(100 + i % 50);
  Calibration calibration;
  calibration.width = map->width();
  calibration.height = map->height();
  calibration.k = {500.0, 0.0, 10.0, 0.0, 500.0, 10.0, 0.0, 0.0, 1.0};
  try {
    const XrayFrame frame = makeXrayFrame(std::move(image), 255.0, calibration, {}, nullptr, map);
    for (const float value : frame.attenuation.values().pixels) require(std::isfinite(value), "attenuation is finite");
  } catch (const FrameError& error) {
    requireWords(error.what());
  }
}

}  // namespace
}  // namespace xray_registration::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const std::string path = fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "map.yaml");
  try {
    fuzz::straighten(std::make_shared<const UndistortionMap>(UndistortionMap::read(path)));
  } catch (const UndistortionMapError& error) {
    fuzz::requireWords(error.what());
  }
  return 0;
}

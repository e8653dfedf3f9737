#include "xray_registration/image/mask.h"

#include <algorithm>
#include <string>

namespace xray_registration {
namespace {

void intersect(const MaskImage& other, MaskImage* mask) {
  for (std::size_t i = 0; i < mask->pixels.size(); ++i) {
    if (other.pixels[i] == 0) mask->pixels[i] = 0;
  }
}

void checkSize(const char* name, const MaskImage& mask, const FloatImage& image) {
  if (mask.width == image.width && mask.height == image.height) return;
  throw FrameError(std::string(name) + " has " + std::to_string(mask.width) + " × " + std::to_string(mask.height) +
                   " pixels, the image " + std::to_string(image.width) + " × " + std::to_string(image.height));
}

}  // namespace

void maskFrame(XrayFrame* frame, const MaskOptions& options, const MaskImage& user) {
  if (!user.empty()) checkSize("the mask image (image/mask)", user, frame->attenuation);
  if (frame->mask.empty()) frame->mask = MaskImage(frame->attenuation.width, frame->attenuation.height, 255);
  checkSize("the frame's mask", frame->mask, frame->attenuation);
  if (options.collimator) intersect(fieldMask(frame->attenuation), &frame->mask);
  // What is searched next is judged against the field alone: letters and metal do not hide each other.
  const MaskImage field = frame->mask;
  if (options.letters) intersect(letterMask(frame->attenuation, field), &frame->mask);
  if (options.metal) intersect(metalMask(frame->attenuation, field), &frame->mask);
  if (!user.empty()) intersect(user, &frame->mask);
}

}  // namespace xray_registration

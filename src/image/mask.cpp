#include "xray_registration/image/mask.h"

#include <algorithm>
#include <string>

#include "image/mask_common.h"

namespace xray_registration {
namespace {

void intersect(const MaskImage& other, MaskImage* mask) {
  // In a form that compilers turn into vector instructions.
  const std::uint8_t* from = other.pixels.data();
  std::uint8_t* to = mask->pixels.data();
  const std::size_t count = mask->pixels.size();
  for (std::size_t i = 0; i < count; ++i) to[i] = from[i] == 0 ? std::uint8_t{0} : to[i];
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
  if (options.letters || options.metal) {
    const mask_detail::SearchCopy copy(frame->attenuation);
    if (options.letters) mask_detail::leaveOut(mask_detail::lettersIn(copy, field), copy.factor(), &frame->mask);
    if (options.metal) mask_detail::leaveOut(mask_detail::metalIn(copy, field), copy.factor(), &frame->mask);
  }
  if (!user.empty()) intersect(user, &frame->mask);
}

}  // namespace xray_registration

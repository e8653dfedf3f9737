#include "xray_registration/image/mask.h"

#include <algorithm>
#include <opencv2/core/utility.hpp>
#include <string>

#include "image/mask_common.h"
#include "xray_registration/image/metal_memory.h"

namespace xray_registration {
namespace {

void intersect(const MaskImage& other, MaskImage* mask) {
  // In a form that compilers turn into vector instructions.
  const std::uint8_t* from = other.pixels.data();
  std::uint8_t* to = mask->pixels.data();
  const std::size_t count = mask->pixels.size();
  for (std::size_t i = 0; i < count; ++i) to[i] = from[i] == 0 ? std::uint8_t{0} : to[i];
}

void checkSize(const char* name, const MaskImage& mask, const AttenuationImage& image) {
  if (mask.width == image.width() && mask.height == image.height()) return;
  throw FrameError(std::string(name) + " has " + std::to_string(mask.width) + " × " + std::to_string(mask.height) +
                   " pixels, the image " + std::to_string(image.width()) + " × " + std::to_string(image.height()));
}

/// How long metal that was found counts: a rod may be behind dense bone for a while.
constexpr std::uint8_t kRememberedFrames = 10;

/// What is metal in this frame, with what is known from those before, and remembers it.
cv::Mat steadyMetal(const mask_detail::SearchCopy& copy, const MaskImage& field, MetalMemory* memory) {
  if (memory == nullptr) return mask_detail::metalIn(copy, field);
  const cv::Size size = copy.fine().size();
  MaskImage& left = memory->frames_left;
  if (left.width != size.width || left.height != size.height) left = MaskImage(size.width, size.height, 0);
  cv::Mat known = mask_detail::view(left);
  cv::Mat found = mask_detail::metalIn(copy, field, known);
  for (std::size_t i = 0; i < left.pixels.size(); ++i) {
    const bool is_metal = !found.empty() && found.data[i] != 0;
    std::uint8_t& frames = left.pixels[i];
    frames = is_metal ? kRememberedFrames : static_cast<std::uint8_t>(frames - (frames > 0 ? 1 : 0));
  }
  return found;
}

}  // namespace

void maskFrame(XrayFrame* frame, const MaskOptions& options, const MaskImage& user) {
  maskFrame(frame, options, user, nullptr);
}

void maskFrame(XrayFrame* frame, const MaskOptions& options, const MaskImage& user, MetalMemory* metal) {
  if (!user.empty()) checkSize("the mask image (image/mask)", user, frame->attenuation);
  if (frame->mask.empty()) frame->mask = MaskImage(frame->attenuation.width(), frame->attenuation.height(), 255);
  checkSize("the frame's mask", frame->mask, frame->attenuation);
  if (options.collimator || options.letters || options.metal) {
    const mask_detail::SearchCopy copy(frame->attenuation);
    if (options.collimator) intersect(mask_detail::fieldIn(copy), &frame->mask);
    // What is searched next is judged against the field alone: letters and metal do not hide each other.
    const MaskImage field = frame->mask;
    cv::Mat letters_found, metal_found;
    cv::parallel_for_({0, 2}, [&](const cv::Range& range) {
      for (int search = range.start; search < range.end; ++search) {
        if (search == 0 && options.metal) metal_found = steadyMetal(copy, field, metal);
        if (search == 1 && options.letters) letters_found = mask_detail::lettersIn(copy, field);
      }
    });
    mask_detail::leaveOut(letters_found, copy.factor(), &frame->mask);
    mask_detail::leaveOut(metal_found, copy.factor(), &frame->mask);
  }
  if (!user.empty()) intersect(user, &frame->mask);
}

}  // namespace xray_registration

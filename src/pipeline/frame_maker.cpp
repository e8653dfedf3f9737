#include "xray_registration/pipeline/frame_maker.h"

#include <algorithm>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "pipeline/failure_text.h"
#include "xray_registration/common/stopwatch.h"

namespace xray_registration {
namespace {

MaskImage readMask(const std::string& path, const std::string& parameter) {
  const cv::Mat mask = cv::imread(path, cv::IMREAD_GRAYSCALE);
  if (mask.empty()) {
    throw ParameterError("parameter " + parameter + " is '" + path +
                         "', which cannot be read; allowed: an 8-bit PNG or PGM image, non-zero = use");
  }
  MaskImage result(mask.cols, mask.rows);
  for (int v = 0; v < mask.rows; ++v) std::copy_n(mask.ptr<std::uint8_t>(v), mask.cols, &result.at(0, v));
  return result;
}

std::string sizeInWords(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

/// The largest value that the detector can give.
double saturationOf(const RawImage& raw, const ImageParameters& options) {
  const double saturation = options.max_value > 0.0 ? options.max_value : raw.saturation;
  const bool unbounded = saturation >= static_cast<double>(std::numeric_limits<float>::max());
  if (!unbounded || options.linearize.kind != ImageKind::kInverted || raw.pixels.empty()) return saturation;
  // An inverted image in floats has no largest value but its own.
  return *std::max_element(raw.pixels.pixels.begin(), raw.pixels.pixels.end());
}

}  // namespace

FrameMaker::FrameMaker(const ImageParameters& options, const std::vector<std::string>& view_names) : options_(options) {
  for (const std::string& view : view_names) {
    const auto own = options.masks.find(view);
    const bool has_own = own != options.masks.end() && !own->second.empty();
    const std::string& path = has_own ? own->second : options.mask;
    if (!path.empty()) masks_[view] = readMask(path, has_own ? "image/masks/" + view : "image/mask");
  }
}

ViewInput FrameMaker::makeView(RawView raw) {
  if (!raw.image) throw FrameError(raw.problem.empty() ? "no image" : raw.problem);
  const double saturation = saturationOf(*raw.image, options_);
  XrayFrame frame =
      makeXrayFrame(std::move(raw.image->pixels), saturation, raw.calibration, options_.linearize, &maps_[raw.name]);
  const MaskImage& user = masks_[raw.name];
  if (!user.empty() && (user.width != frame.attenuation.width || user.height != frame.attenuation.height)) {
    throw FrameError("the image is " + sizeInWords(frame.attenuation.width, frame.attenuation.height) +
                     " but its mask (image/mask) is " + sizeInWords(user.width, user.height));
  }
  maskFrame(&frame, options_.find, user);
  return ViewInput(std::make_shared<const XrayFrame>(std::move(frame)), raw.T_view_first);
}

FrameViews FrameMaker::make(std::vector<RawView> views) {
  const Stopwatch watch;
  FrameViews frame;
  frame.views.resize(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string name = views[i].name;
    try {
      frame.views[i] = makeView(std::move(views[i]));
      frame.used.push_back(name);
    } catch (const std::exception& error) {
      frame.missing.push_back(name);
      if (!frame.problem.empty()) frame.problem += "; ";
      if (!name.empty()) frame.problem += "view '" + name + "': ";
      frame.problem += inWords(error);
    }
  }
  if (frame.used.empty() && frame.problem.empty()) frame.problem = "no view of this frame can be used";
  frame.prepare_ms = watch.milliseconds();
  return frame;
}

}  // namespace xray_registration

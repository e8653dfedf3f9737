#include "xray_registration/pipeline/frame_maker.h"

#include <algorithm>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "pipeline/failure_text.h"
#include "xray_registration/common/parallel.h"
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

std::shared_ptr<const UndistortionMap> readMap(const std::string& path, const std::string& parameter) {
  try {
    return std::make_shared<const UndistortionMap>(UndistortionMap::read(path));
  } catch (const UndistortionMapError& error) {
    throw ParameterError("parameter " + parameter + " is '" + path + "', which cannot be used: " + error.what());
  }
}

/// A file of one view, and the parameter that names it.
struct ViewFile {
  std::string path;  ///< Empty: none.
  std::string parameter;
};

/// The view's own file, image/<name>s/<view>, or else that of all views, image/<name>.
ViewFile fileOf(const std::string& view, const std::string& name, const std::map<std::string, std::string>& own_files,
                const std::string& common_file) {
  const auto own = own_files.find(view);
  if (own != own_files.end() && !own->second.empty()) return {own->second, "image/" + name + "s/" + view};
  return {common_file, "image/" + name};
}

std::string sizeInWords(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

/// The largest value that the detector can give.
double saturationOf(const RawImage& raw, const ImageParameters& options) {
  const double saturation = options.max_value > 0.0 ? options.max_value : raw.saturation;
  const bool unbounded = saturation >= static_cast<double>(std::numeric_limits<float>::max());
  const FloatImage& floats = raw.pixels.floats;
  if (!unbounded || options.linearize.kind != ImageKind::kInverted || floats.empty()) return saturation;
  // An inverted image in floats has no largest value but its own.
  return *std::max_element(floats.pixels.begin(), floats.pixels.end());
}

}  // namespace

std::shared_ptr<const UndistortionMap> undistortionMapOf(const ImageParameters& options, const std::string& view) {
  const ViewFile map = fileOf(view, "undistortion_map", options.undistortion_maps, options.undistortion_map);
  return map.path.empty() ? nullptr : readMap(map.path, map.parameter);
}

FrameMaker::FrameMaker(const ImageParameters& options, const std::vector<std::string>& view_names) : options_(options) {
  for (const std::string& name : view_names) {
    View& view = views_[name];
    const ViewFile mask = fileOf(name, "mask", options.masks, options.mask);
    if (!mask.path.empty()) view.mask = readMask(mask.path, mask.parameter);
    view.map = undistortionMapOf(options, name);
  }
}

ViewInput FrameMaker::makeView(RawView* raw) {
  if (!raw->image) throw FrameError(raw->problem.empty() ? "no image" : raw->problem);
  View& view = views_.at(raw->name);
  const double saturation = saturationOf(*raw->image, options_);
  XrayFrame frame = makeXrayFrame(std::move(raw->image->pixels), saturation, raw->calibration, options_.linearize,
                                  &view.pixels, view.map);
  if (!view.mask.empty() &&
      (view.mask.width != frame.attenuation.width() || view.mask.height != frame.attenuation.height())) {
    throw FrameError("the image is " + sizeInWords(frame.attenuation.width(), frame.attenuation.height()) +
                     " but its mask (image/mask) is " + sizeInWords(view.mask.width, view.mask.height));
  }
  maskFrame(&frame, options_.find, view.mask, &view.metal);
  ViewInput input(std::make_shared<const XrayFrame>(std::move(frame)), raw->T_view_first);
  input.name = raw->name;
  return input;
}

FrameViews FrameMaker::make(std::vector<RawView> views) {
  const Stopwatch watch;
  FrameViews frame;
  frame.views.resize(views.size());
  std::vector<std::string> problems(views.size());
  for (const RawView& view : views) views_[view.name];  // Nothing is added while views are made.
  parallelFor(static_cast<int>(views.size()), [&](int begin, int end) {
    for (int view = begin; view < end; ++view) {
      const auto i = static_cast<std::size_t>(view);
      try {
        frame.views[i] = makeView(&views[i]);
      } catch (const std::exception& error) {
        problems[i] = inWords(error);
      }
    }
  });
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string& name = views[i].name;
    if (frame.views[i]) {
      frame.used.push_back(name);
      continue;
    }
    frame.missing.push_back(name);
    if (!frame.problem.empty()) frame.problem += "; ";
    if (!name.empty()) frame.problem += "view '" + name + "': ";
    frame.problem += problems[i];
  }
  if (frame.used.empty() && frame.problem.empty()) frame.problem = "no view of this frame can be used";
  frame.prepare_ms = watch.milliseconds();
  return frame;
}

}  // namespace xray_registration

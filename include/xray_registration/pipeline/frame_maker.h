#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/image/metal_memory.h"
#include "xray_registration/image/raw_image.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// One view of a frame as it came in: either pixels with their calibration, or why there are none.
struct RawView {
  std::string name;  ///< As in the parameter `views`; empty for a single view.
  std::optional<RawImage> image;
  Calibration calibration;
  RigidTransform T_view_first = RigidTransform::Identity();  ///< Points of the first view's camera into this one's.
  std::string problem;                                       ///< Why `image` is empty, in words.
};

/// A frame's views as a registrar takes them.
struct FrameViews {
  std::vector<std::optional<ViewInput>> views;  ///< As many as came in, in their order; empty where one is missing.
  std::vector<std::string> used;                ///< Names of the views that are there,
  std::vector<std::string> missing;             ///< and of those that are not.
  std::string problem;                          ///< Why views are missing, in words; empty when all are there.
  double prepare_ms = 0.0;
};

/// The undistortion map of a view; null where it has none.
/// @throws ParameterError when it cannot be read.
std::shared_ptr<const UndistortionMap> undistortionMapOf(const ImageParameters& options, const std::string& view);

/// Turns pixels into what is registered: linearises, straightens, masks. Keeps the masks and undistortion maps of the
/// parameters, and where each view's pixels come from. Not thread-safe.
class FrameMaker {
 public:
  /// Reads the masks and undistortion maps that the parameters name.
  /// @throws ParameterError when one cannot be read.
  FrameMaker(const ImageParameters& options, const std::vector<std::string>& view_names);

  /// What is wrong with a view is said in the result; nothing is thrown for it. Hand the views over by std::move: their
  /// pixels become the attenuation in place.
  FrameViews make(std::vector<RawView> views);

 private:
  ViewInput makeView(RawView* raw);

  /// What belongs to one view.
  struct View {
    MaskImage mask;                              ///< Empty where there is none.
    std::shared_ptr<const UndistortionMap> map;  ///< Null where there is none.
    StraightenedPixels pixels;                   ///< Kept between frames,
    MetalMemory metal;                           ///< as is this.
  };

  ImageParameters options_;
  std::map<std::string, View> views_;  ///< By name.
};

}  // namespace xray_registration

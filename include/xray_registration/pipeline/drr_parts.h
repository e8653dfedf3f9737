#pragma once

#include <vector>

#include "xray_registration/image/image.h"
#include "xray_registration/pipeline/body_parameters.h"
#include "xray_registration/pipeline/overlay.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// A result's DRR in parts whose line integrals add.
struct DrrParts {
  /// The CT without what moves in it on its own; the whole CT where it was refused, and nothing is known of its bodies.
  /// Empty where a body stands for the CT.
  FloatImage ct;
  std::vector<FloatImage> bodies;  ///< As the result's; empty for one that has no pose.
};

/// The sum of what was accepted: a picture of where things are known to be. Empty when nothing was.
FloatImage acceptedDrr(const DrrParts& parts, const RegistrationResult& result);

/// The CT's edges in green, or red when it was refused; the outline of each body in the colour of its place in
/// `bodies`, or in red dashes.
std::vector<OverlayLine> overlayLines(const DrrParts& parts, const RegistrationResult& result,
                                      const std::vector<BodyParameters>& bodies);

/// A view as large as is looked at: binned until no side is longer than 800 pixels. What is drawn of it costs a
/// fraction; a smaller view is returned as it is.
ViewInput forDisplay(const ViewInput& view);

}  // namespace xray_registration

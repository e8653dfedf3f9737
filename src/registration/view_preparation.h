#pragma once

#include "xray_registration/image/xray_frame.h"

namespace xray_registration {

/// A view cut to where the CT can appear and binned to what the solver can use.
struct PreparedView {
  XrayCamera camera;
  FloatImage attenuation;
  FloatImage weight;
};

/// Crops to the projection of a sphere (centre in the view's camera frame, radius with its margin), then bins, but not
/// below 8 pixels a side. A crop that would keep most of the image is not made. Pixels without weight hold the mean of
/// the others.
PreparedView prepareView(const XrayFrame& view, const Eigen::Vector3d& centre_camera_mm, double radius_mm, int binning);

}  // namespace xray_registration

#pragma once

#include <vector>

#include "xray_registration/image/xray_frame.h"

namespace xray_registration {

/// A view cut to where the CT can appear and binned to what the solver can use.
struct PreparedView {
  XrayCamera camera;
  FloatImage attenuation;
  FloatImage weight;
};

/// Where a CT can be, in a view's camera frame.
struct ShadowBounds {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0.0;                   ///< Of a sphere around it, with its margin.
  std::vector<Eigen::Vector3d> corners_mm;  ///< Of a box around it, where that is known too,
  double margin_mm = 0.0;                   ///< and how far it may be from there.
};

/// Crops to what the projections of both sphere and box cover, then bins, but not below 8 pixels a side. A crop that
/// would keep most of the image is not made. Pixels without weight hold the mean of the others.
PreparedView prepareView(const XrayFrame& view, const ShadowBounds& bounds, int binning);

}  // namespace xray_registration

#pragma once

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// Pinhole X-ray camera in REP-103 optical axes: origin in the X-ray source, z towards the detector, x along columns,
/// y along rows. Integer pixel coordinates are pixel centres. Focal lengths in pixels: f = SDD / pixel pitch.
/// Lens distortion is removed from images before a camera of this type describes them.
struct XrayCamera {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;

  /// Pixel (u, v) of a point in the camera frame (mm). The point's z must be positive.
  Eigen::Vector2d project(const Eigen::Vector3d& point_camera_mm) const;

  /// Direction of the ray through pixel (u, v) with unit z component; not normalised.
  Eigen::Vector3d rayDirection(double u, double v) const;

  /// Camera of the image binned `factor` × `factor` (partial bins at the right and bottom are dropped).
  XrayCamera binned(int factor) const;

  /// Camera of the window of this image with its first pixel at (x, y).
  XrayCamera cropped(int x, int y, int window_width, int window_height) const;

  /// Size of a pixel projected back to `depth_mm`, mean of both axes.
  double pixelSizeAt(double depth_mm) const;

  /// Empty when the camera is usable, else what is wrong in words.
  const char* problem() const;
};

bool operator==(const XrayCamera& a, const XrayCamera& b);
inline bool operator!=(const XrayCamera& a, const XrayCamera& b) { return !(a == b); }

}  // namespace xray_registration

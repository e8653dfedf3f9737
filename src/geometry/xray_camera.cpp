#include "xray_registration/geometry/xray_camera.h"

#include <cmath>

namespace xray_registration {

Eigen::Vector2d XrayCamera::project(const Eigen::Vector3d& point_camera_mm) const {
  return {cx + fx * point_camera_mm.x() / point_camera_mm.z(), cy + fy * point_camera_mm.y() / point_camera_mm.z()};
}

Eigen::Vector3d XrayCamera::rayDirection(double u, double v) const { return {(u - cx) / fx, (v - cy) / fy, 1.0}; }

XrayCamera XrayCamera::binned(int factor) const {
  XrayCamera camera;
  camera.width = width / factor;
  camera.height = height / factor;
  camera.fx = fx / factor;
  camera.fy = fy / factor;
  // Pixel edges scale; centres lie half a pixel inside.
  camera.cx = (cx + 0.5) / factor - 0.5;
  camera.cy = (cy + 0.5) / factor - 0.5;
  return camera;
}

XrayCamera XrayCamera::cropped(int x, int y, int window_width, int window_height) const {
  XrayCamera camera = *this;
  camera.width = window_width;
  camera.height = window_height;
  camera.cx -= x;
  camera.cy -= y;
  return camera;
}

double XrayCamera::pixelSizeAt(double depth_mm) const { return 0.5 * depth_mm * (1.0 / fx + 1.0 / fy); }

const char* XrayCamera::problem() const {
  if (width <= 0 || height <= 0) return "the image size is zero or negative";
  if (!std::isfinite(fx) || !std::isfinite(fy) || fx <= 0.0 || fy <= 0.0) {
    return "the focal length is not positive (is the camera calibrated?)";
  }
  if (!std::isfinite(cx) || !std::isfinite(cy)) return "the principal point is not finite";
  return "";
}

bool operator==(const XrayCamera& a, const XrayCamera& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy;
}

}  // namespace xray_registration

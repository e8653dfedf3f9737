#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "xray_registration/geometry/xray_camera.h"

namespace xray_registration {

/// Pixels of an X-ray's full size, from low to below high.
struct PixelBox {
  double u_low = 0.0;
  double v_low = 0.0;
  double u_high = std::numeric_limits<double>::max();
  double v_high = std::numeric_limits<double>::max();
};

/// One X-ray on the device, full size (0) and halved again and again, as those who do not know the device see it. An
/// Engine makes it and fills it; it holds memory of the device until it is destroyed. Several bodies may look at one
/// X-ray, each through a resident X-ray of its own that shares the pixels and their weights (Engine::share).
class ResidentXray {
 public:
  struct Level {
    XrayCamera camera;
    int tiles_x = 0;
    int tiles_y = 0;
    int tiles() const { return tiles_x * tiles_y; }
  };

  ResidentXray() = default;
  ResidentXray(const ResidentXray&) = delete;
  ResidentXray& operator=(const ResidentXray&) = delete;
  virtual ~ResidentXray() = default;

  const std::vector<Level>& levels() const { return levels_; }
  const Level& level(int index) const { return levels_.at(static_cast<std::size_t>(index)); }
  int lastLevel() const { return static_cast<int>(levels_.size()) - 1; }
  /// Standard deviation of the attenuation over the allowed pixels.
  double deviation() const { return deviation_; }

  /// From now on only tiles that touch one of the boxes are used; all where there is none. What surrounds the body is
  /// forgotten.
  virtual void limitTo(const std::vector<PixelBox>& boxes) = 0;
  /// The opposite, in place of the boxes left out before.
  virtual void leaveOut(const std::vector<PixelBox>& boxes) = 0;
  /// Forgets what surrounds the body (Engine::surround): where it moved.
  virtual void forgetSurroundings() = 0;
  /// Whether a level has what surrounds the body.
  virtual bool isSurrounded(int level) const = 0;

  /// The line integral at which the detector saturates: DRRs become S (1 − exp(−DRR / S)), as a metal implant's inside
  /// is one grey. Zero: it does not.
  void setSaturation(double line_integral) { saturation_ = line_integral; }
  double saturation() const { return saturation_; }

 protected:
  std::vector<Level> levels_;
  double deviation_ = 1.0;
  double saturation_ = 0.0;
};

}  // namespace xray_registration

#pragma once

#include <cstddef>
#include <vector>

#include "xray_registration/geometry/xray_camera.h"

namespace xray_registration {

/// One X-ray on the device, full size (0) and halved again and again, as those who do not know the device see it. An
/// Engine makes it and fills it; it holds memory of the device until it is destroyed.
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

 protected:
  std::vector<Level> levels_;
  double deviation_ = 1.0;
};

}  // namespace xray_registration

#pragma once

#include <memory>
#include <vector>

#include "drr/opencl/workbench.h"
#include "xray_registration/drr/resident_xray.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// The buffers of one X-ray; they go on to the next one.
struct XrayStorage {
  struct Level {
    GrowingBuffer attenuation;
    GrowingBuffer weight;      ///< 0 … 1 per pixel; 0 leaves it out.
    GrowingBuffer used_tiles;  ///< Per tile, 0 leaves it out.
    GrowingBuffer contrast;    ///< Per tile, variance of the X-ray.
  };
  GrowingBuffer mask;  ///< Weights as uploaded, full size.
  std::vector<Level> levels;
};

/// Storage of X-rays that are gone, the one that waits longest first.
using SpareStorage = std::vector<std::unique_ptr<XrayStorage>>;

/// An X-ray in OpenCL buffers. Levels are made when they are needed: a tracked frame looks at two of them. Errors of
/// the calls are cl::Error.
class OpenClXray : public ResidentXray {
 public:
  /// Transfers; nothing is launched.
  OpenClXray(const XrayCamera& camera, const FloatImage& attenuation, const FloatImage& weight,
             std::shared_ptr<SpareStorage> spares, Workbench* bench);
  /// Gives the storage to the spares.
  ~OpenClXray() override;

  /// The weights as uploaded.
  void restoreWeights();
  /// weight = mask · map on full size, the map's points kMapStep pixels apart; later levels follow.
  void weigh(const cl::Buffer& map, int map_width, int map_height, Workbench* bench);
  void keepContrastTiles(int level, double part, Workbench* bench);

  /// Makes the level and those above it, if they are not there.
  void makeReady(int level, Workbench* bench);

  // Of a level that is ready.
  const cl::Buffer& attenuation(int level) const { return storageOf(level).attenuation.get(); }
  const cl::Buffer& weight(int level) const;
  const cl::Buffer& usedTiles(int level) const { return storageOf(level).used_tiles.get(); }

 private:
  const XrayStorage::Level& storageOf(int level) const { return storage_->levels[static_cast<std::size_t>(level)]; }
  XrayStorage::Level& storageOf(int level) { return storage_->levels[static_cast<std::size_t>(level)]; }
  void addLevel(const XrayCamera& camera);
  void halveInto(int level, Workbench* bench);
  void markTiles(int level, Workbench* bench);

  std::shared_ptr<SpareStorage> spares_;
  std::unique_ptr<XrayStorage> storage_;
  bool weighed_ = false;     ///< The finest level's weights are its own and not the mask's.
  bool tiles_kept_ = false;  ///< Some level uses only a part of its tiles.
  int ready_levels_ = 0;     ///< Levels whose attenuation, weights and tiles are up to date.
};

}  // namespace xray_registration

#pragma once

#include <memory>
#include <vector>

#include "drr/opencl/workbench.h"
#include "xray_registration/drr/resident_xray.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// The buffers of an X-ray's pixels; they go on to the next one.
struct PixelStorage {
  struct Level {
    GrowingBuffer attenuation;
    GrowingBuffer weight;  ///< 0 … 1 per pixel; 0 leaves it out.
  };
  GrowingBuffer mask;  ///< Weights as uploaded, full size.
  std::vector<Level> levels;
};

/// The buffers of one look at an X-ray.
struct LookStorage {
  struct Level {
    GrowingBuffer used_tiles;    ///< Per tile, 0 leaves it out.
    GrowingBuffer contrast;      ///< Per tile, variance of the X-ray.
    GrowingBuffer surroundings;  ///< Per pixel, line integrals.
  };
  std::vector<Level> levels;
};

/// Storage of X-rays that are gone, the one that waits longest first.
struct SpareStorage {
  std::vector<std::unique_ptr<PixelStorage>> pixels;
  std::vector<std::unique_ptr<LookStorage>> looks;
};

/// An X-ray's pixels and their weights in OpenCL buffers, shared by all who look at it. Levels are made when they are
/// needed: a tracked frame looks at two of them. Errors of the calls are cl::Error.
class XrayPixels {
 public:
  /// Transfers; nothing is launched. `levels` are those of the X-ray.
  XrayPixels(const std::vector<ResidentXray::Level>& levels, const FloatImage& attenuation, const FloatImage& weight,
             std::shared_ptr<SpareStorage> spares, Workbench* bench);
  /// Gives the storage to the spares.
  ~XrayPixels();
  XrayPixels(const XrayPixels&) = delete;
  XrayPixels& operator=(const XrayPixels&) = delete;

  /// The weights as uploaded.
  void restoreWeights();
  /// weight = mask · map on full size, the map's points kMapStep pixels apart; later levels follow.
  void weigh(const cl::Buffer& map, int map_width, int map_height, Workbench* bench);
  /// Makes the level and those above it, if they are not there.
  void makeReady(int level, Workbench* bench);

  // Of a level that is ready.
  const cl::Buffer& attenuation(int level) const { return storageOf(level).attenuation.get(); }
  const cl::Buffer& weight(int level) const;

  /// Changes with the weights.
  int revision() const { return revision_; }
  const std::shared_ptr<SpareStorage>& spares() const { return spares_; }

 private:
  const PixelStorage::Level& storageOf(int level) const { return storage_->levels[static_cast<std::size_t>(level)]; }
  PixelStorage::Level& storageOf(int level) { return storage_->levels[static_cast<std::size_t>(level)]; }
  const XrayCamera& cameraOf(int level) const { return levels_[static_cast<std::size_t>(level)].camera; }
  void halveInto(int level, Workbench* bench);

  std::vector<ResidentXray::Level> levels_;
  std::shared_ptr<SpareStorage> spares_;
  std::unique_ptr<PixelStorage> storage_;
  bool weighed_ = false;  ///< The finest level's weights are its own and not the mask's.
  int ready_levels_ = 0;  ///< Levels whose attenuation and weights are up to date.
  int revision_ = 0;
};

/// The longest-waiting spare, or a new one.
template <typename Storage>
std::unique_ptr<Storage> takenFrom(std::vector<std::unique_ptr<Storage>>* spares) {
  if (spares->empty()) return std::make_unique<Storage>();
  std::unique_ptr<Storage> storage = std::move(spares->front());
  spares->erase(spares->begin());
  return storage;
}

/// Keeps it for the next one; without memory for that it is freed.
template <typename Storage>
void giveTo(std::vector<std::unique_ptr<Storage>>* spares, std::unique_ptr<Storage> storage) {
  try {
    spares->push_back(std::move(storage));
  } catch (const std::bad_alloc&) {
    // Then it is freed.
  }
}

}  // namespace xray_registration

#pragma once

#include <memory>
#include <vector>

#include "drr/opencl/workbench.h"
#include "drr/opencl/xray_pixels.h"
#include "xray_registration/drr/resident_xray.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// One look at an X-ray in OpenCL buffers: its pixels, which may be shared with other looks, and what is this body's
/// own, the tiles that are used and what surrounds it. Errors of the calls are cl::Error.
class OpenClXray : public ResidentXray {
 public:
  /// Transfers; nothing is launched.
  OpenClXray(const XrayCamera& camera, const FloatImage& attenuation, const FloatImage& weight,
             const std::shared_ptr<SpareStorage>& spares, Workbench* bench);
  /// Another look at the same pixels.
  explicit OpenClXray(const OpenClXray& other);
  OpenClXray& operator=(const OpenClXray&) = delete;
  /// Gives the storage to the spares.
  ~OpenClXray() override;

  void limitTo(const std::vector<PixelBox>& boxes) override;
  void leaveOut(const std::vector<PixelBox>& boxes) override;
  void forgetSurroundings() override;
  void forgetSurroundings(int level) { surrounded_[static_cast<std::size_t>(level)] = 0; }
  bool isSurrounded(int level) const override { return surrounded(level) != 0; }

  /// The weights as uploaded, unless they are another look's to weigh; and all tiles.
  void restoreWeights();
  /// weight = mask · map on full size, the map's points kMapStep pixels apart; later levels follow.
  void weigh(const cl::Buffer& map, int map_width, int map_height, Workbench* bench);
  void keepContrastTiles(int level, double part, Workbench* bench);
  /// All that the limits leave.
  void useAllTiles();
  /// Adds an image of the level's size to what surrounds the body.
  void surroundWith(const cl::Buffer& image, int level, Workbench* bench);

  /// Makes the level and those above it, if they are not there.
  void makeReady(int level, Workbench* bench);

  // Of a level that is ready.
  const cl::Buffer& attenuation(int level) const { return pixels_->attenuation(level); }
  const cl::Buffer& weight(int level) const { return pixels_->weight(level); }
  const cl::Buffer& usedTiles(int level) const { return storageOf(level).used_tiles.get(); }
  /// Nothing that means anything where surrounded() is 0.
  const cl::Buffer& surroundings(int level) const;
  /// 1 or 0, as kernels take it.
  cl_int surrounded(int level) const { return surrounded_[static_cast<std::size_t>(level)]; }

 private:
  const LookStorage::Level& storageOf(int level) const { return storage_->levels[static_cast<std::size_t>(level)]; }
  LookStorage::Level& storageOf(int level) { return storage_->levels[static_cast<std::size_t>(level)]; }
  void addLevel(const XrayCamera& camera);
  void takeStorage();
  void markTiles(int level, Workbench* bench);

  std::shared_ptr<XrayPixels> pixels_;
  std::unique_ptr<LookStorage> storage_;
  bool owns_weights_ = true;
  std::vector<PixelBox> limits_;
  std::vector<PixelBox> left_out_;
  bool tiles_kept_ = false;  ///< Some level uses only a part of its tiles.
  int revision_ = 0;         ///< Of the pixels that the tiles were marked for.
  int marked_levels_ = 0;    ///< Levels whose tiles are up to date.
  std::vector<cl_int> surrounded_;
};

}  // namespace xray_registration

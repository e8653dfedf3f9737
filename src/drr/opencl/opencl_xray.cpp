#include "drr/opencl/opencl_xray.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xray_registration/common/statistics.h"

namespace xray_registration {
namespace {

constexpr int kSmallestSide = 32;  ///< Of the coarsest level, pixels.

/// Of one image of floats.
std::size_t bytesOf(const XrayCamera& camera) {
  return sizeof(float) * static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

/// Standard deviation of the pixels with weight; above zero.
double deviationOf(const FloatImage& image, const FloatImage& weight) {
  double sum = 0.0;
  double sum2 = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const double w = weight.pixels[i] > 0.0F ? 1.0 : 0.0;
    sum += w * image.pixels[i];
    sum2 += w * image.pixels[i] * image.pixels[i];
    count += w;
  }
  return count > 0.0 ? std::sqrt(std::max(sum2 / count - sum * sum / (count * count), 1e-12)) : 1.0;
}

std::unique_ptr<XrayStorage> takenFrom(SpareStorage* spares) {
  if (spares->empty()) return std::make_unique<XrayStorage>();
  std::unique_ptr<XrayStorage> storage = std::move(spares->front());
  spares->erase(spares->begin());
  return storage;
}

}  // namespace

OpenClXray::OpenClXray(const XrayCamera& camera, const FloatImage& attenuation, const FloatImage& weight,
                       std::shared_ptr<SpareStorage> spares, Workbench* bench)
    : spares_(std::move(spares)), storage_(takenFrom(spares_.get())) {
  deviation_ = deviationOf(attenuation, weight);
  addLevel(camera);
  while (std::min(levels_.back().camera.width, levels_.back().camera.height) >= 2 * kSmallestSide) {
    addLevel(levels_.back().camera.binned(2));
  }
  if (storage_->levels.size() < levels_.size()) storage_->levels.resize(levels_.size());
  const std::size_t bytes = bytesOf(camera);
  bench->queue().enqueueWriteBuffer(storageOf(0).attenuation.atLeast(bytes, bench), CL_FALSE, 0, bytes,
                                    attenuation.pixels.data());
  bench->queue().enqueueWriteBuffer(storage_->mask.atLeast(bytes, bench), CL_TRUE, 0, bytes, weight.pixels.data());
}

OpenClXray::~OpenClXray() {
  try {
    spares_->push_back(std::move(storage_));
  } catch (const std::bad_alloc&) {
    // Then it is freed.
  }
}

void OpenClXray::addLevel(const XrayCamera& camera) {
  levels_.push_back({camera, layout::tilesFor(camera.width), layout::tilesFor(camera.height)});
}

const cl::Buffer& OpenClXray::weight(int level) const {
  return level == 0 && !weighed_ ? storage_->mask.get() : storageOf(level).weight.get();
}

void OpenClXray::restoreWeights() {
  if (weighed_ || tiles_kept_) ready_levels_ = 0;
  weighed_ = false;
  tiles_kept_ = false;
}

void OpenClXray::weigh(const cl::Buffer& map, int map_width, int map_height, Workbench* bench) {
  const XrayCamera& camera = levels_.front().camera;
  bench->run(&bench->kernels().apply_map, perItem(camera.width * camera.height), storage_->mask.get(), map,
             camera.width, camera.height, map_width, map_height, storageOf(0).weight.atLeast(bytesOf(camera), bench));
  weighed_ = true;
  tiles_kept_ = false;
  ready_levels_ = 0;
}

void OpenClXray::makeReady(int level, Workbench* bench) {
  for (; ready_levels_ <= level; ++ready_levels_) {
    if (ready_levels_ > 0) halveInto(ready_levels_, bench);
    markTiles(ready_levels_, bench);
  }
}

void OpenClXray::halveInto(int level, Workbench* bench) {
  const XrayCamera& fine = levels_[static_cast<std::size_t>(level - 1)].camera;
  const XrayCamera& half = levels_[static_cast<std::size_t>(level)].camera;
  XrayStorage::Level& storage = storageOf(level);
  bench->run(&bench->kernels().halve_xray, perItem(half.width * half.height), attenuation(level - 1), weight(level - 1),
             fine.width, fine.height, half.width, half.height, storage.attenuation.atLeast(bytesOf(half), bench),
             storage.weight.atLeast(bytesOf(half), bench));
  bench->countHalving();
}

void OpenClXray::markTiles(int level, Workbench* bench) {
  const Level& seen = levels_[static_cast<std::size_t>(level)];
  const auto tiles = static_cast<std::size_t>(seen.tiles());
  XrayStorage::Level& storage = storageOf(level);
  bench->run(&bench->kernels().used_tiles, perItem(seen.tiles()), attenuation(level), weight(level), seen.camera.width,
             seen.camera.height, seen.tiles_x, seen.tiles(), storage.used_tiles.atLeast(sizeof(cl_int) * tiles, bench),
             storage.contrast.atLeast(sizeof(float) * tiles, bench));
}

void OpenClXray::keepContrastTiles(int level, double part, Workbench* bench) {
  makeReady(level, bench);
  const auto count = static_cast<std::size_t>(levels_[static_cast<std::size_t>(level)].tiles());
  std::vector<float> contrast(count);
  bench->queue().enqueueReadBuffer(storageOf(level).contrast.get(), CL_TRUE, 0, sizeof(float) * count, contrast.data());
  std::vector<float> sorted = contrast;
  const float threshold = quantileBelow(&sorted, 1.0 - part);
  std::vector<cl_int> used(count);
  for (std::size_t i = 0; i < count; ++i) used[i] = contrast[i] > 0.0F && contrast[i] >= threshold ? 1 : 0;
  bench->queue().enqueueWriteBuffer(storageOf(level).used_tiles.get(), CL_TRUE, 0, sizeof(cl_int) * count, used.data());
  tiles_kept_ = true;
}

}  // namespace xray_registration

#include "drr/opencl/opencl_xray.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xray_registration/common/statistics.h"

namespace xray_registration {
namespace {

constexpr int kSmallestSide = 32;  ///< Of the coarsest level, pixels.

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

/// The box in pixels of the level, as kernels take it.
cl_float4 boxOn(int level, const PixelBox& box) {
  const auto scaled = [level](double value) {
    constexpr double kBeyondAnyImage = 1e9;
    return static_cast<float>(std::clamp(value, -kBeyondAnyImage, kBeyondAnyImage) / static_cast<double>(1 << level));
  };
  return {{scaled(box.u_low), scaled(box.v_low), scaled(box.u_high), scaled(box.v_high)}};
}

}  // namespace

OpenClXray::OpenClXray(const XrayCamera& camera, const FloatImage& attenuation, const FloatImage& weight,
                       const std::shared_ptr<SpareStorage>& spares, Workbench* bench) {
  deviation_ = deviationOf(attenuation, weight);
  addLevel(camera);
  while (std::min(levels_.back().camera.width, levels_.back().camera.height) >= 2 * kSmallestSide) {
    addLevel(levels_.back().camera.binned(2));
  }
  pixels_ = std::make_shared<XrayPixels>(levels_, attenuation, weight, spares, bench);
  takeStorage();
}

OpenClXray::OpenClXray(const OpenClXray& other) : ResidentXray(), pixels_(other.pixels_), owns_weights_(false) {
  levels_ = other.levels_;
  deviation_ = other.deviation_;
  takeStorage();
}

OpenClXray::~OpenClXray() { giveTo(&pixels_->spares()->looks, std::move(storage_)); }

void OpenClXray::takeStorage() {
  storage_ = takenFrom(&pixels_->spares()->looks);
  if (storage_->levels.size() < levels_.size()) storage_->levels.resize(levels_.size());
  surrounded_.assign(levels_.size(), 0);
  revision_ = pixels_->revision();
}

void OpenClXray::addLevel(const XrayCamera& camera) {
  levels_.push_back({camera, layout::tilesFor(camera.width), layout::tilesFor(camera.height)});
}

void OpenClXray::useAllTiles() {
  marked_levels_ = 0;
  tiles_kept_ = false;
  forgetSurroundings();  // They were drawn on the tiles that were used.
}

void OpenClXray::limitTo(const std::vector<PixelBox>& boxes) {
  limits_ = boxes;
  useAllTiles();
}

void OpenClXray::leaveOut(const std::vector<PixelBox>& boxes) {
  left_out_ = boxes;
  useAllTiles();
}

void OpenClXray::forgetSurroundings() { surrounded_.assign(levels_.size(), 0); }

const cl::Buffer& OpenClXray::surroundings(int level) const {
  return surrounded(level) != 0 ? storageOf(level).surroundings.get() : attenuation(level);
}

void OpenClXray::surroundWith(const cl::Buffer& image, int level, Workbench* bench) {
  const XrayCamera& camera = levels_[static_cast<std::size_t>(level)].camera;
  const int pixels = camera.width * camera.height;
  const cl_int begins = surrounded(level) == 0 ? 1 : 0;
  bench->run(&bench->kernels().surround, perItem(pixels), image, pixels, begins,
             storageOf(level).surroundings.atLeast(sizeof(float) * static_cast<std::size_t>(pixels), bench));
  surrounded_[static_cast<std::size_t>(level)] = 1;
}

void OpenClXray::restoreWeights() {
  if (owns_weights_) pixels_->restoreWeights();
  if (tiles_kept_ || revision_ != pixels_->revision()) useAllTiles();
}

void OpenClXray::weigh(const cl::Buffer& map, int map_width, int map_height, Workbench* bench) {
  pixels_->weigh(map, map_width, map_height, bench);
  useAllTiles();
}

void OpenClXray::makeReady(int level, Workbench* bench) {
  pixels_->makeReady(level, bench);
  if (revision_ != pixels_->revision()) {
    revision_ = pixels_->revision();
    useAllTiles();
  }
  for (; marked_levels_ <= level; ++marked_levels_) markTiles(marked_levels_, bench);
}

void OpenClXray::markTiles(int level, Workbench* bench) {
  const Level& seen = levels_[static_cast<std::size_t>(level)];
  const auto tiles = static_cast<std::size_t>(seen.tiles());
  LookStorage::Level& storage = storageOf(level);
  const std::vector<PixelBox> everywhere = {PixelBox()};
  cl_int begins = 1;
  for (const PixelBox& box : limits_.empty() ? everywhere : limits_) {
    bench->run(&bench->kernels().used_tiles, perItem(seen.tiles()), attenuation(level), weight(level),
               seen.camera.width, seen.camera.height, seen.tiles_x, seen.tiles(), boxOn(level, box), begins,
               storage.used_tiles.atLeast(sizeof(cl_int) * tiles, bench),
               storage.contrast.atLeast(sizeof(float) * tiles, bench));
    begins = 0;
  }
  for (const PixelBox& box : left_out_) {
    bench->run(&bench->kernels().leave_out_tiles, perItem(seen.tiles()), seen.tiles_x, seen.tiles(), boxOn(level, box),
               storage.used_tiles.get(), storage.contrast.get());
  }
}

void OpenClXray::keepContrastTiles(int level, double part, Workbench* bench) {
  makeReady(level, bench);
  const auto count = static_cast<std::size_t>(levels_[static_cast<std::size_t>(level)].tiles());
  std::vector<float> contrast(count);
  bench->queue().enqueueReadBuffer(storageOf(level).contrast.get(), CL_TRUE, 0, sizeof(float) * count, contrast.data());
  std::vector<float> sorted = contrast;
  // What a box leaves out is not part of what is chosen from.
  if (!limits_.empty()) sorted.erase(std::remove(sorted.begin(), sorted.end(), 0.0F), sorted.end());
  if (sorted.empty()) return;
  const float threshold = quantileBelow(&sorted, 1.0 - part);
  std::vector<cl_int> used(count);
  for (std::size_t i = 0; i < count; ++i) used[i] = contrast[i] > 0.0F && contrast[i] >= threshold ? 1 : 0;
  bench->queue().enqueueWriteBuffer(storageOf(level).used_tiles.get(), CL_TRUE, 0, sizeof(cl_int) * count, used.data());
  tiles_kept_ = true;
}

}  // namespace xray_registration

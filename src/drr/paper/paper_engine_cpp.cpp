#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drr/paper/paper_filter.h"
#include "xray_registration/drr/paper/paper_engine.h"

namespace xray_registration {
namespace {

/// Volume in float with one layer of air around, so that tri-linear interpolation fades to zero without a branch.
class PaddedVolume {
 public:
  explicit PaddedVolume(const AttenuationVolume& volume) : size_(volume.grid.size) {
    row_ = size_.x() + 2;
    slice_ = row_ * (size_.y() + 2);
    values_.assign(static_cast<std::size_t>(slice_) * static_cast<std::size_t>(size_.z() + 2), 0.0F);
    const std::uint16_t* from = volume.values.data();
    for (int z = 0; z < size_.z(); ++z) {
      for (int y = 0; y < size_.y(); ++y) {
        float* to = values_.data() + slice_ * (z + 1) + row_ * (y + 1) + 1;
        for (int x = 0; x < size_.x(); ++x) to[x] = static_cast<float>(*from++) * volume.scale_per_mm;
      }
    }
  }

  /// Value at continuous voxel indices shifted by +1; the caller keeps them in [0, size + 1).
  float at(float x, float y, float z) const {
    const int ix = static_cast<int>(x);
    const int iy = static_cast<int>(y);
    const int iz = static_cast<int>(z);
    const float fx = x - static_cast<float>(ix);
    const float fy = y - static_cast<float>(iy);
    const float fz = z - static_cast<float>(iz);
    const float* c = values_.data() + (slice_ * iz + row_ * iy + ix);
    const float c00 = c[0] + fx * (c[1] - c[0]);
    const float c10 = c[row_] + fx * (c[row_ + 1] - c[row_]);
    const float c01 = c[slice_] + fx * (c[slice_ + 1] - c[slice_]);
    const float c11 = c[slice_ + row_] + fx * (c[slice_ + row_ + 1] - c[slice_ + row_]);
    const float c0 = c00 + fy * (c10 - c00);
    const float c1 = c01 + fy * (c11 - c01);
    return c0 + fz * (c1 - c0);
  }

  /// The samples s of a ray origin + (first + s step) direction (shifted indices) that lie inside, as [begin, end).
  void clip(const float* origin, const float* direction, float first, float step, int samples, int* begin,
            int* end) const {
    float low = 0.0F;
    float high = static_cast<float>(samples - 1);
    for (int axis = 0; axis < 3; ++axis) {
      const float upper = static_cast<float>(size_[axis] + 1);
      const float start = origin[axis] + first * direction[axis];
      const float slope = step * direction[axis];
      if (std::abs(slope) < 1e-12F) {
        if (start <= 0.0F || start >= upper) high = -1.0F;
        continue;
      }
      const float a = -start / slope;
      const float b = (upper - start) / slope;
      low = std::max(low, std::min(a, b));
      high = std::min(high, std::max(a, b));
    }
    *begin = high < low ? 0 : static_cast<int>(std::ceil(low));
    *end = high < low ? 0 : static_cast<int>(std::floor(high)) + 1;
  }

  /// Rounding may put a sample at the end of the clipped range a hair outside.
  void clamp(float* p) const {
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = std::min(std::max(p[axis], 0.0F), std::nextafter(static_cast<float>(size_[axis] + 1), 0.0F));
    }
  }

  std::size_t bytes() const { return values_.size() * sizeof(float); }

 private:
  Eigen::Vector3i size_;
  std::ptrdiff_t row_ = 0;
  std::ptrdiff_t slice_ = 0;
  std::vector<float> values_;
};

class PaperEngineCpp : public PaperEngine {
 public:
  void setVolume(const AttenuationVolume& volume) override {
    volume_ = std::make_unique<PaddedVolume>(volume);
    grid_ = volume.grid;
  }

  void setTarget(const FloatImage& target, const MaskImage& mask, const PaperFilter& filter) override {
    target_ = target;
    weights_ = weightsOf(mask, target.width, target.height);
    smooth_taps_ = gaussianTaps(filter.smooth_sigma_px);
    background_taps_ = gaussianTaps(filter.background_sigma_px);
    if (!smooth_taps_.empty()) smooth_norm_ = inverseBlurredWeights(weights_, smooth_taps_);
    if (!background_taps_.empty()) background_norm_ = inverseBlurredWeights(weights_, background_taps_);
    filtered_target_ = filtered(target_);
    for (FloatImage& slot : slots_) slot = FloatImage(target.width, target.height);
  }

  void render(int slot, const PaperRays& rays) override {
    FloatImage& image = slots_.at(static_cast<std::size_t>(slot));
    if (image.width != rays.width || image.height != rays.height || !volume_) {
      throw std::logic_error("paper engine: setVolume and setTarget come before render, with one image size");
    }
    for (int v = 0; v < rays.height; ++v) {
      for (int u = 0; u < rays.width; ++u) image.at(u, v) = castRay(rays, u, v);
    }
  }

  void finish() override {}
  FloatImage read(int slot) override { return slots_.at(static_cast<std::size_t>(slot)); }

  PaperMoments moments(const std::array<double, 6>& steps) override {
    std::array<FloatImage, kPaperSlots> f;
    const bool filter = !smooth_taps_.empty() || !background_taps_.empty();
    if (filter) {
      for (std::size_t k = 0; k < f.size(); ++k) f[k] = filtered(slots_[k]);
    }
    return reduce(filter ? f : slots_, steps);
  }

  const VolumeGrid& grid() const override { return grid_; }
  std::string name() const override { return "C++, one thread"; }
  std::size_t deviceBytes() const override { return volume_ ? volume_->bytes() : 0; }

 private:
  float castRay(const PaperRays& rays, int u, int v) const {
    const float fu = static_cast<float>(u);
    const float fv = static_cast<float>(v);
    const float a = (fu - rays.cx) * rays.inverse_fx;
    const float b = (fv - rays.cy) * rays.inverse_fy;
    const float inverse_length = 1.0F / std::sqrt(a * a + b * b + 1.0F);
    float origin[3];
    float direction[3];
    for (int axis = 0; axis < 3; ++axis) {
      origin[axis] = rays.origin[axis] + 1.0F;  // One layer of air.
      direction[axis] = (rays.corner[axis] + fu * rays.column[axis] + fv * rays.row[axis]) * inverse_length;
    }
    // Samples outside add zero; a loop on one thread simply need not visit them.
    int begin = 0;
    int end = 0;
    volume_->clip(origin, direction, rays.first_mm, rays.step_mm, rays.samples, &begin, &end);
    float sum = 0.0F;
    for (int s = begin; s < end; ++s) {
      const float t = rays.first_mm + static_cast<float>(s) * rays.step_mm;
      float p[3] = {origin[0] + t * direction[0], origin[1] + t * direction[1], origin[2] + t * direction[2]};
      volume_->clamp(p);
      sum += volume_->at(p[0], p[1], p[2]);
    }
    return sum * rays.scale;
  }

  /// weights · (smooth(image) − background(image)).
  FloatImage filtered(const FloatImage& image) const {
    FloatImage weighted = image;
    for (std::size_t i = 0; i < weighted.pixels.size(); ++i) weighted.pixels[i] *= weights_.pixels[i];
    FloatImage scratch;
    FloatImage result = weighted;
    if (!smooth_taps_.empty()) {
      blur(weighted, smooth_taps_, &scratch, &result);
      for (std::size_t i = 0; i < result.pixels.size(); ++i) result.pixels[i] *= smooth_norm_.pixels[i];
    }
    if (!background_taps_.empty()) {
      FloatImage background;
      blur(weighted, background_taps_, &scratch, &background);
      for (std::size_t i = 0; i < result.pixels.size(); ++i) {
        result.pixels[i] -= background.pixels[i] * background_norm_.pixels[i];
      }
    }
    for (std::size_t i = 0; i < result.pixels.size(); ++i) result.pixels[i] *= weights_.pixels[i];
    return result;
  }

  PaperMoments reduce(const std::array<FloatImage, kPaperSlots>& f, const std::array<double, 6>& steps) const {
    std::array<float, 6> inverse_steps{};
    for (std::size_t k = 0; k < 6; ++k) inverse_steps[k] = static_cast<float>(1.0 / steps[k]);
    std::array<double, 45> sums{};
    for (std::size_t i = 0; i < weights_.pixels.size(); ++i) {
      const float w = weights_.pixels[i];
      if (w == 0.0F) continue;
      float z[9];
      const float f0 = f[0].pixels[i];
      for (std::size_t k = 0; k < 6; ++k) z[k] = (f[k + 1].pixels[i] - f0) * inverse_steps[k];
      z[6] = f0;
      z[7] = 1.0F;
      z[8] = filtered_target_.pixels[i] - f0;
      std::size_t n = 0;
      for (int a = 0; a < 9; ++a) {
        for (int b = a; b < 9; ++b) sums[n++] += static_cast<double>(z[a] * z[b]);
      }
    }
    PaperMoments moments;
    std::size_t n = 0;
    for (int a = 0; a < 9; ++a) {
      for (int b = a; b < 9; ++b) moments(a, b) = moments(b, a) = sums[n++];
    }
    return moments;
  }

  std::unique_ptr<PaddedVolume> volume_;
  VolumeGrid grid_;
  FloatImage target_;
  FloatImage filtered_target_;
  FloatImage weights_;
  FloatImage smooth_norm_;
  FloatImage background_norm_;
  std::vector<float> smooth_taps_;
  std::vector<float> background_taps_;
  std::array<FloatImage, kPaperSlots> slots_;
};

}  // namespace

std::unique_ptr<PaperEngine> makePaperEngineCpp() { return std::make_unique<PaperEngineCpp>(); }

}  // namespace xray_registration

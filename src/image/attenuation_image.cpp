#include "xray_registration/image/attenuation_image.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace xray_registration {

AttenuationImage::AttenuationImage(FloatImage values) : floats_(std::move(values)) {}

AttenuationImage::AttenuationImage(CountImage counts, std::vector<float> worth)
    : counts_(std::move(counts)), worth_(std::move(worth)) {}

const float* AttenuationImage::row(int v, int first, int count, std::vector<float>* buffer) const {
  if (worth_.empty()) return &floats_.at(first, v);
  if (buffer->size() < static_cast<std::size_t>(count)) buffer->resize(static_cast<std::size_t>(count));
  const std::uint16_t* counts = &counts_.at(first, v);
  const float* worth = worth_.data();
  float* values = buffer->data();
  for (int u = 0; u < count; ++u) values[u] = worth[counts[u]];
  return values;
}

FloatImage AttenuationImage::values() const {
  if (worth_.empty()) return floats_;
  FloatImage all(width(), height());
  std::transform(counts_.pixels.begin(), counts_.pixels.end(), all.pixels.begin(),
                 [this](std::uint16_t count) { return worth_[count]; });
  return all;
}

FloatImage& AttenuationImage::floats() {
  if (!worth_.empty()) *this = AttenuationImage(values());
  return floats_;
}

bool AttenuationImage::allFinite() const {
  const std::vector<float>& values = worth_.empty() ? floats_.pixels : worth_;
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

}  // namespace xray_registration

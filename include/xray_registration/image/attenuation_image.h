#pragma once

#include <cstdint>
#include <vector>

#include "xray_registration/image/image.h"

namespace xray_registration {

/// The attenuation of every pixel of an X-ray. Where a detector counted, its counts stay as they came, in 16 bits,
/// beside a table of what each is worth: whoever needs values takes rows or bins of them, and no frame is written out
/// in floats. May be read by several threads.
class AttenuationImage {
 public:
  AttenuationImage() = default;
  /// Values as they are.
  AttenuationImage(FloatImage values);  // NOLINT(google-explicit-constructor): nothing else is meant by them.
  /// @param worth  Attenuation by count; as long as the largest count that occurs needs.
  AttenuationImage(CountImage counts, std::vector<float> worth);

  int width() const { return worth_.empty() ? floats_.width : counts_.width; }
  int height() const { return worth_.empty() ? floats_.height : counts_.height; }
  bool empty() const { return floats_.empty() && counts_.empty(); }
  float at(int u, int v) const {
    return worth_.empty() ? floats_.at(u, v) : worth_[static_cast<std::size_t>(counts_.at(u, v))];
  }

  /// `count` values of row v from column `first` on: in the image's own memory, or else in `buffer`, which is made long
  /// enough.
  const float* row(int v, int first, int count, std::vector<float>* buffer) const;
  const float* row(int v, std::vector<float>* buffer) const { return row(v, 0, width(), buffer); }

  /// All values; a copy.
  FloatImage values() const;
  /// All values, to be changed: counts are written out first.
  FloatImage& floats();

  /// Null where there are counts.
  const FloatImage* plain() const { return worth_.empty() ? &floats_ : nullptr; }
  /// Null where there are none.
  const CountImage* counts() const { return worth_.empty() ? nullptr : &counts_; }
  /// By count; empty where there are none.
  const std::vector<float>& worth() const { return worth_; }

  bool allFinite() const;

 private:
  FloatImage floats_;
  CountImage counts_;
  std::vector<float> worth_;  ///< Empty where floats_ holds the values.
};

}  // namespace xray_registration

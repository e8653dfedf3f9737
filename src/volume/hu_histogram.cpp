#include "hu_histogram.h"

#include <algorithm>
#include <limits>

#include "xray_registration/volume/hu_landmarks.h"

namespace xray_registration {
namespace {

constexpr int kLowest = std::numeric_limits<std::int16_t>::min();
constexpr int kHighest = std::numeric_limits<std::int16_t>::max();
constexpr std::size_t kSamples = 4000000;

std::size_t place(int value) { return static_cast<std::size_t>(std::clamp(value, kLowest, kHighest) - kLowest); }

}  // namespace

HuHistogram::HuHistogram(const std::vector<std::int16_t>& hu) : counts_(place(kHighest) + 1) {
  // Odd, so that it does not step along a column of a volume whose rows are a power of two.
  const std::size_t step = (hu.size() / kSamples) | 1U;
  for (std::size_t i = 0; i < hu.size(); i += step) {
    ++counts_[place(hu[i])];
    ++total_;
  }
}

void HuHistogram::leaveOut(std::int16_t value) {
  total_ -= counts_[place(value)];
  counts_[place(value)] = 0;
}

double HuHistogram::share(int low, int high) const {
  if (total_ == 0) return 0.0;
  std::size_t sum = 0;
  for (std::size_t i = place(low); i <= place(high); ++i) sum += counts_[i];
  return static_cast<double>(sum) / static_cast<double>(total_);
}

int HuHistogram::quantile(double share) const {
  const double below = share * static_cast<double>(total_);
  double sum = 0.0;
  for (int value = kLowest; value < kHighest; ++value) {
    sum += counts_[place(value)];
    if (sum > below) return value;
  }
  return kHighest;
}

std::optional<int> HuHistogram::peak(int low, int high) const {
  const auto begin = counts_.begin();
  const auto most = std::max_element(begin + static_cast<std::ptrdiff_t>(place(low)),
                                     begin + static_cast<std::ptrdiff_t>(place(high)) + 1);
  if (*most == 0) return std::nullopt;
  return static_cast<int>(most - begin) + kLowest;
}

HuLandmarks huLandmarks(const Volume& ct) {
  const HuHistogram histogram(ct.hu);
  HuLandmarks marks;
  marks.low_hu = histogram.quantile(0.001);
  marks.high_hu = histogram.quantile(0.999);
  marks.air_share = histogram.share(-1150, -850);
  marks.soft_tissue_share = histogram.share(-200, 200);
  marks.bone_share = histogram.share(201, 2500);
  marks.metal_share = histogram.share(2501, kHighest);
  marks.air_hu = histogram.peak(-1150, -850);
  marks.soft_tissue_hu = histogram.peak(-200, 200);
  return marks;
}

}  // namespace xray_registration

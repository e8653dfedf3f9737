#include "drr/opencl/shift_matcher.h"

#include <algorithm>

namespace xray_registration {
namespace {

constexpr float kLeastShadow = 0.05F;  // A line integral that is seen.
constexpr float kLeastShare = 0.3F;    // Of what is seen, that has to lie in the image.
constexpr float kFlat = 0.01F;         // Of the X-ray's variance: a part that varies less holds nothing.

}  // namespace

std::vector<float> ShiftMatcher::match(const ShiftTarget& target, const cl::Buffer& drrs, std::size_t poses,
                                       Workbench* bench) {
  upload(target, bench);
  const auto shifts = static_cast<std::size_t>(target.shifts());
  std::vector<float> correlations(poses * shifts * shifts);
  const std::size_t bytes = sizeof(float) * correlations.size();
  correlations_.atLeast(bytes, bench);
  if (target.detail_radius > 0) {
    matchShown(target, drrs, poses, bench);
  } else {
    const XrayCamera seen = target.widened();
    bench->run(&bench->kernels().match_everywhere, groupsOf(bench->itemsOfShifts(), poses * shifts), drrs, seen.width,
               seen.height, xray_.get(), target.camera.width, target.camera.height, target.shifts(), pixels_, power_,
               correlations_.get());
  }
  bench->queue().enqueueReadBuffer(correlations_.get(), CL_TRUE, 0, bytes, correlations.data());
  return correlations;
}

/// The values that are used get the mean 0, which single precision is content with.
void ShiftMatcher::upload(const ShiftTarget& target, Workbench* bench) {
  const bool local = target.detail_radius > 0;
  const FloatImage image = local ? detailOf(target.attenuation, target.mask, target.detail_radius) : target.attenuation;
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (target.mask.pixels[i] == 0) continue;
    sum += image.pixels[i];
    count += 1.0;
  }
  const auto mean = static_cast<float>(count > 0.0 ? sum / count : 0.0);
  std::vector<float>& floats = staging_.refill();
  floats.assign(2 * image.pixels.size(), 0.0F);
  double power = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (target.mask.pixels[i] == 0) continue;
    const float value = image.pixels[i] - mean;
    floats[2 * i] = value;
    floats[2 * i + 1] = 1.0F;
    power += static_cast<double>(value) * value;
  }
  pixels_ = static_cast<float>(count);
  power_ = static_cast<float>(power);
  staging_.writeTo(&xray_, bench);
}

void ShiftMatcher::matchShown(const ShiftTarget& target, const cl::Buffer& drrs, std::size_t poses, Workbench* bench) {
  const XrayCamera seen = target.widened();
  const std::size_t pixels = poses * static_cast<std::size_t>(seen.width) * static_cast<std::size_t>(seen.height);
  const std::size_t bytes = sizeof(float) * (pixels + kPixelsBehindShifts);
  FastKernels& k = bench->kernels();
  bench->run(&k.outline, perItem(static_cast<int>(pixels)), drrs, seen.width, seen.height, static_cast<cl_int>(pixels),
             target.detail_radius, kLeastShadow, detail_.atLeast(bytes, bench), shown_.atLeast(bytes, bench));
  const float flat = kFlat * power_ / std::max(pixels_, 1.0F);
  bench->run(&k.match_shown, groupsOf(bench->itemsOfShifts(), poses * static_cast<std::size_t>(target.shifts())),
             detail_.get(), shown_.get(), seen.width, seen.height, xray_.get(), target.camera.width,
             target.camera.height, target.shifts(), kLeastShare, flat, correlations_.get());
}

}  // namespace xray_registration

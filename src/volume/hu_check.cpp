#include "hu_check.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "hu_histogram.h"
#include "padding.h"

namespace xray_registration {
namespace {

constexpr std::size_t kFewestVoxels = 1000;
constexpr double kLargestHu = 1e5;     // Solid gold has 30000 at a CT's energies, as far as scanners count.
constexpr double kNarrowestHu = 30.0;  // Noise of a CT alone is wider.

HuDoubt sure(const std::string& what) {
  return {what + ". If they are Hounsfield units all the same, ct/check_values: false", true};
}

// HU that the numbers of the file come to, without rounding.
struct HuRange {
  double low = 0.0;
  double high = 0.0;
};

// Padding left out.
HuRange rangeOf(const ValueFacts& facts, const FileRule& rule) {
  if (!(facts.low <= facts.high)) return {facts.low, facts.high};  // There is none.
  const double a = facts.low * rule.slope + rule.intercept;
  const double b = facts.high * rule.slope + rule.intercept;
  return {std::min(a, b), std::max(a, b)};
}

std::string inWords(const HuRange& range) {
  std::ostringstream text;
  text << "its values run from " << range.low << " to " << range.high;
  return text.str();
}

HuDoubt doubtAboutNarrow(const HuRange& range) {
  const std::string start = inWords(range) + ", which are no Hounsfield units: ";
  if (range.low == range.high) return sure(start + "they are all the same");
  if (range.high <= 0.2) {
    return sure(start + "attenuation in 1/mm? Then set ct/hu_slope: 50000 and ct/hu_intercept: -1000 (water has 0.02)");
  }
  return sure(
      start +
      "attenuation in 1/cm (ct/hu_slope: 5000, ct/hu_intercept: -1000; water has 0.2), thousands of HU "
      "(ct/hu_slope: 1000), or HU that were scaled to 0…1? Then set ct/hu_slope to the width of their range and "
      "ct/hu_intercept to its lower end, e.g. 4000 and -1000");
}

HuDoubt doubtAboutRange(const FileImage<std::int16_t>& image, const FileRule& rule) {
  const HuRange range = rangeOf(image.facts, rule);
  if (!(range.low <= range.high)) return sure("none of its voxels holds a number: it is damaged, or of another kind");
  if (range.low < -kLargestHu || range.high > kLargestHu) {
    return sure(
        inWords(range) +
        ", which are no Hounsfield units. If one of them marks voxels without a value, name it in ct/padding; if "
        "they are HU times a factor, give ct/hu_slope and ct/hu_intercept");
  }
  if (image.facts.padded == 0 && range.high - range.low < kNarrowestHu) return doubtAboutNarrow(range);
  const bool is_untouched = rule.slope == 1.0 && rule.intercept == 0.0;
  if ((is_untouched && image.facts.eight_bits) || (range.low >= 0.0 && range.high <= 255.0)) {
    return sure(
        inWords(range) +
        ", as in a picture of 8 bits; Hounsfield units need more. Take the CT itself, or say which range of HU "
        "became 0 to 255: ct/hu_slope: its width / 255, ct/hu_intercept: its lower end (-1000 to 2000 HU: 11.765 "
        "and -1000)");
  }
  return {};
}

// Whether it looks like a CT whose scale is shifted by so much. What was cut out from within a body also has voxels
// near 24 and 1024 HU, of muscle and bone. But it has fat below, and more spongy bone than dense one.
bool looksShifted(const HuHistogram& histogram, int shift) {
  const double air = histogram.share(shift - 1100, shift - 850);
  const double tissue = histogram.share(shift - 200, shift + 300);
  if (air < 0.05 || tissue < 0.005) return false;
  // Most scanners cut their noise off at -1024 HU.
  const int low = histogram.quantile(0.001);
  if (low >= shift - 1084) return true;
  return low >= shift - 1200 && histogram.share(shift - 1200, shift - 1084) < 0.02 &&
         tissue > 2.0 * histogram.share(shift - 800, shift - 250);
}

HuDoubt doubtAboutShift(const HuHistogram& histogram) {
  for (const int shift : {1024, -1024}) {
    if (!looksShifted(histogram, shift)) continue;
    const int air = histogram.peak(shift - 1100, shift - 850).value_or(shift - 1000);
    const int amount = std::abs(air + 1000) < 1012 ? 1000 : 1024;
    std::ostringstream text;
    text << "its air lies near " << air << " instead of -1000 HU: Hounsfield units with " << amount
         << (shift > 0 ? " added" : " taken off") << "? Then set ct/hu_intercept: " << (shift > 0 ? -amount : amount);
    return sure(text.str());
  }
  return {};
}

// Air is a large part of a CT and its lower end; turned round it is the upper one, and bone the lower one.
HuDoubt doubtAboutSign(const HuHistogram& histogram) {
  const double upper = histogram.share(900, 1100);
  const bool is_turned = upper >= 0.15 && upper > 5.0 * histogram.share(-1100, -900) &&
                         histogram.share(-300, 300) >= 0.005 && histogram.share(1200, 32767) < 0.01 &&
                         histogram.quantile(0.001) < -150;
  if (!is_turned) return {};
  return sure("its air lies near 1000 instead of -1000 HU: turned round? Then set ct/hu_slope: -1");
}

// No voxel, or hardly any, is air.
HuDoubt doubtWithoutAir(const HuHistogram& whole, const HuHistogram& rest, std::optional<std::int16_t> at_edges) {
  // Padding and what a mask left may be at the edges, or air without noise.
  const bool edges_hold_nothing = at_edges && (*at_edges == 0 || *at_edges < -1150);
  const HuHistogram& histogram = edges_hold_nothing ? rest : whole;
  HuDoubt shift = doubtAboutShift(histogram);
  if (!shift.what.empty()) return shift;
  if (at_edges == std::int16_t{0}) {
    return sure(
        "it holds no air, and 0 where it ends, which as Hounsfield units is water. If 0 marks what was cut away, set "
        "ct/padding: 0");
  }
  const int low = histogram.quantile(0.001);
  std::ostringstream text;
  text << "it holds no air (near -1000 HU); its values begin at " << low << ", ";
  if (low >= -50) {
    text << "where not even fat is. An image of another kind (MR), or Hounsfield units with something added? "
            "ct/hu_slope and ct/hu_intercept say what is to be made of the values";
    return sure(text.str());
  }
  text << "so it was cut out from within a body, or these are no Hounsfield units (ct/hu_slope and ct/hu_intercept say "
          "what is to be made of the values)";
  return {text.str(), false};
}

// `is_padded`: some of the air was padding, and says nothing.
HuDoubt doubtWithAir(const HuHistogram& whole, const HuHistogram& rest, std::optional<std::int16_t> at_edges,
                     bool is_padded) {
  if (whole.share(2501, 32767) > std::max(0.1, whole.share(-500, 2500))) {
    return sure(
        "more of it lies above 2500 HU than in the range of tissue and bone: turned round, or no Hounsfield units? "
        "ct/hu_slope and ct/hu_intercept say what is to be made of the values");
  }
  // Water, 1024 too low, looks like air.
  if (looksShifted(rest, -1024) && rest.share(-200, 300) < 0.1 * rest.share(-1224, -724)) return doubtAboutShift(rest);
  // What lies around may be air alone, and what was scanned be shifted.
  if (at_edges && rest.share(-1150, -850) < 0.001) {
    HuDoubt doubt = doubtAboutShift(rest);
    doubt.is_sure = doubt.is_sure && is_padded;
    return doubt;
  }
  return {};
}

}  // namespace

HuDoubt doubtAbout(const FileImage<std::int16_t>& image, const FileRule& rule) {
  if (image.voxels.size() < kFewestVoxels) {
    const HuRange range = rangeOf(image.facts, rule);
    const bool is_empty = !(range.low <= range.high) && image.facts.padded == 0;
    return is_empty || range.high > kLargestHu || range.low < -kLargestHu ? doubtAboutRange(image, rule) : HuDoubt{};
  }
  HuDoubt range = doubtAboutRange(image, rule);
  if (!range.what.empty()) return range;
  const HuHistogram whole(image.voxels);
  const auto at_edges = valueAtEdges(image.voxels, image.grid.size);
  HuHistogram rest = whole;
  if (at_edges) rest.leaveOut(*at_edges);
  HuDoubt sign = doubtAboutSign(whole);
  if (!sign.what.empty()) return sign;
  if (whole.share(-1150, -850) >= 0.001) return doubtWithAir(whole, rest, at_edges, image.facts.padded > 0);
  return doubtWithoutAir(whole, rest, at_edges);
}

}  // namespace xray_registration

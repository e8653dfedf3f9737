#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "image/mask_common.h"
#include "xray_registration/image/mask.h"

// Metal is found by two marks together. It stands out from what is around it (white top-hat of the attenuation), by
// more than noise. And all along its outline the step is as sharp as the detector: nearly the whole rise within two
// pixels. A bone's limb thickens like the square root of the distance, so hardly more than half of its rise over six
// pixels lies in two of them; a cortex seen on edge is sharper, but its step is small and its outline does not close.
// Outlines are judged at several levels, so that a rod on dense bone is seen at the level where it stands alone.
namespace xray_registration {
namespace {

using mask_detail::kUse;

// Beads and letters of lead are searched on the fine copy, rods, screws and balls on this one.
constexpr int kCoarseSide = 330;  ///< Its longest side.
constexpr int kFineRadius = 5;    ///< Pixels of the copy; twice this is the largest thickness that is found there.
constexpr int kCoarseRadius = 16;
constexpr int kFineArea = 25;  ///< Least area; what is smaller must be a bead.
constexpr int kCoarseArea = 50;

/// Nepers above the surroundings. The fine copy adds what is thin, which few levels find.
constexpr std::array<float, 4> kCoarseLevels{0.35F, 0.6F, 1.0F, 1.6F};
constexpr std::array<float, 2> kFineLevels{0.35F, 0.8F};
constexpr float kSmallestStep = 0.3F;  ///< Nepers, over six pixels.
constexpr float kSharpness = 0.78F;    ///< Least share of the step that lies in two pixels.
constexpr double kSharpOutline = 0.8;  ///< Least share of the outline that is sharp.
constexpr double kKnownOutline = 0.5;  ///< The same where most of the region was metal a few frames ago.
constexpr double kKnownShare = 0.5;    ///< Least share of the region for that.
constexpr double kAlongField = 0.3;    ///< Largest share of the outline that lies along the field's edge.
constexpr float kThinLevel = 0.35F;
constexpr int kThinArea = 40;
constexpr float kSmallestBead = 0.15F;      ///< Nepers above the surroundings.
constexpr float kBeadRing = 0.4F;           ///< Largest share of that on the ring around a bead.
constexpr float kNoiseFactor = 10.0F;       ///< A bead must be this many standard deviations of the noise,
constexpr float kSmoothNoiseFactor = 6.0F;  ///< and a step of the smoothed picture this many.
constexpr int kFieldRim = 3;                ///< Pixels of the copy that count as the field's edge.
constexpr int kBridge = 5;                  ///< Twice this is the longest gap in a rod that is closed.
constexpr int kRim = 2;                     ///< Pixels of the searched copy around what is found: its blur.

cv::Mat square(int radius) { return cv::Mat::ones(2 * radius + 1, 2 * radius + 1, CV_8U); }

cv::Mat morphed(const cv::Mat& image, int operation, int radius) {
  cv::Mat result;
  cv::morphologyEx(image, result, operation, square(radius), {-1, -1}, 1, cv::BORDER_REPLICATE);
  return result;
}

/// What lies outside of the field takes the mean of what is near it, so that the field's edge is no edge of metal.
cv::Mat filledOutside(const cv::Mat& attenuation, const cv::Mat& field) {
  if (cv::countNonZero(field) == static_cast<int>(field.total())) return attenuation;
  cv::Mat weight;
  field.convertTo(weight, CV_32F, 1.0 / kUse);
  cv::Mat mean = attenuation.mul(weight);
  const cv::Size window(31, 31);
  cv::blur(mean, mean, window);
  cv::blur(weight, weight, window);
  cv::max(weight, 1e-6, weight);
  cv::divide(mean, weight, mean);
  attenuation.copyTo(mean, field);
  return mean;
}

/// Standard deviation of the noise around each pixel: of second differences, which smooth shadows do not have. The mean
/// over a wide window of a value that is cut at a few times its median keeps edges from counting as noise.
cv::Mat localNoise(const cv::Mat& image) {
  cv::Mat second;
  // The mixed second difference of white noise has a standard deviation of 6 times the noise's, and a mean of its
  // absolute value of 0.8 of that.
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1);
  cv::filter2D(image, second, CV_32F, kernel, {-1, -1}, 0.0, cv::BORDER_REFLECT_101);
  second = cv::abs(second);
  cv::Mat noise;
  cv::min(second, 4.0 * std::max(mask_detail::percentile(second, 0.75), 1e-3F), noise);
  cv::blur(noise, noise, {17, 17});
  return noise / (6.0 * 0.8);
}

/// One row of sharpSteps. Without branches, for vector instructions.
void markSharp(const float* near_step, const float* whole_step, const float* noise, int count, std::uint8_t* sharp) {
  for (int u = 0; u < count; ++u) {
    const float least = kSmoothNoiseFactor * noise[u];
    const bool is_high = (whole_step[u] > least) & (whole_step[u] > kSmallestStep);
    const bool is_steep = (near_step[u] > kSharpness * least) & (near_step[u] > kSharpness * kSmallestStep) &
                          (near_step[u] > kSharpness * whole_step[u]);
    sharp[u] = (is_high & is_steep) ? kUse : std::uint8_t{0};
  }
}

/// Pixels where a step is sharp, higher than anatomy's, and not noise.
cv::Mat sharpSteps(const cv::Mat& attenuation, const cv::Mat& noise) {
  const cv::Mat near_step = morphed(attenuation, cv::MORPH_GRADIENT, 1);
  const cv::Mat whole_step = morphed(attenuation, cv::MORPH_GRADIENT, 3);
  cv::Mat sharp(attenuation.size(), CV_8U);
  for (int v = 0; v < sharp.rows; ++v) {
    markSharp(near_step.ptr<float>(v), whole_step.ptr<float>(v), noise.ptr<float>(v), sharp.cols,
              sharp.ptr<std::uint8_t>(v));
  }
  return sharp;
}

/// What is known of a copy before objects are searched in it.
struct Copy {
  cv::Mat attenuation;
  cv::Mat smooth;  ///< Its median over 3 × 3: less noise, edges as sharp.
  cv::Mat noise;
  cv::Mat sharp;
  cv::Mat field_edge;  ///< Near what lies outside of the field.
  cv::Mat known;       ///< Not zero where metal was before; may be empty.
};

Copy prepared(const cv::Mat& attenuation, const cv::Mat& field, const cv::Mat& known) {
  Copy copy;
  if (!known.empty()) cv::resize(known, copy.known, attenuation.size(), 0.0, 0.0, cv::INTER_NEAREST);
  copy.attenuation = filledOutside(attenuation, field);
  copy.noise = localNoise(copy.attenuation);
  cv::medianBlur(copy.attenuation, copy.smooth, 3);
  // The sharpest place of a step may lie a pixel beside the outline at one level.
  cv::dilate(sharpSteps(copy.smooth, copy.noise), copy.sharp, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}));
  copy.field_edge = morphed(~field, cv::MORPH_DILATE, kFieldRim);
  return copy;
}

struct Outline {
  int length = 0;
  int sharp = 0;
  int along_field = 0;
  bool isMetal(bool is_known) const {
    const double least = is_known ? kKnownOutline : kSharpOutline;
    return length > 0 && sharp >= least * length && along_field <= kAlongField * length;
  }
};

/// Whether most of a region was metal before.
bool isKnown(const cv::Mat& region, const cv::Mat& known) {
  if (known.empty()) return false;
  return cv::countNonZero(region & (known != 0)) >= kKnownShare * cv::countNonZero(region);
}

std::vector<Outline> outlines(const mask_detail::Parts& parts, const cv::Mat& sharp, const cv::Mat& field_edge) {
  const cv::Mat& labels = parts.labels;
  std::vector<Outline> result(parts.parts.size());
  for (int v = 0; v < labels.rows; ++v) {
    const int* label = labels.ptr<int>(v);
    const int* above = labels.ptr<int>(std::max(v - 1, 0));
    const int* below = labels.ptr<int>(std::min(v + 1, labels.rows - 1));
    const std::uint8_t* is_sharp = sharp.ptr<std::uint8_t>(v);
    const std::uint8_t* is_edge = field_edge.ptr<std::uint8_t>(v);
    for (int u = 0; u < labels.cols; ++u) {
      const int own = label[u];
      if (own == 0) continue;
      const int left = label[std::max(u - 1, 0)];
      const int right = label[std::min(u + 1, labels.cols - 1)];
      if (left == own && right == own && above[u] == own && below[u] == own) continue;
      Outline& outline = result[static_cast<std::size_t>(own)];
      ++outline.length;
      outline.sharp += is_sharp[u] != 0 ? 1 : 0;
      outline.along_field += is_edge[u] != 0 ? 1 : 0;
    }
  }
  return result;
}

/// Where metal may be: what is above a level.
struct Candidates {
  cv::Mat above;
  int least_area;
};

/// Adds the regions of the candidates whose outline is metal's.
void addMetal(const Copy& copy, const Candidates& candidates, cv::Mat* metal) {
  if (cv::countNonZero(candidates.above & copy.sharp) == 0) return;
  // A rim of what is not above the level closes the outlines.
  const cv::Rect area = mask_detail::boxAround(candidates.above, 1);
  const mask_detail::Parts above = mask_detail::partsOf(candidates.above(area), 8);
  const std::vector<Outline> found = outlines(above, copy.sharp(area), copy.field_edge(area));
  for (std::size_t i = 1; i < found.size(); ++i) {
    const Outline& outline = found[i];
    const cv::Rect& box = above.parts[i].box;
    if (above.parts[i].pixels < candidates.least_area || !outline.isMetal(true)) continue;
    const cv::Mat region = above.labels(box) == static_cast<int>(i);
    const bool is_known = isKnown(region, copy.known.empty() ? copy.known : copy.known(area)(box));
    if (outline.isMetal(is_known)) (*metal)(area)(box).setTo(kUse, region);
  }
}

/// The same for many, side by side.
cv::Mat metalAmong(const Copy& copy, const std::vector<Candidates>& candidates) {
  cv::Mat metal = cv::Mat::zeros(copy.sharp.size(), CV_8U);
  std::mutex mutex;
  cv::parallel_for_({0, static_cast<int>(candidates.size())}, [&](const cv::Range& range) {
    cv::Mat found = cv::Mat::zeros(metal.size(), CV_8U);
    for (int i = range.start; i < range.end; ++i) addMetal(copy, candidates[static_cast<std::size_t>(i)], &found);
    const std::lock_guard<std::mutex> lock(mutex);
    metal |= found;
  });
  return metal;
}

/// What is thin and sharp on both sides. Without the pixels that are far from a sharp step, a rod and the bone that it
/// crosses come apart.
Candidates thinCandidates(const Copy& copy, const cv::Mat& thin_excess) {
  return {(thin_excess > kThinLevel) & morphed(copy.sharp, cv::MORPH_DILATE, 2), kThinArea};
}

/// Offsets of the pixels on a ring of about `radius`.
std::vector<cv::Point> ringOf(int radius) {
  std::vector<cv::Point> ring;
  for (int v = -radius; v <= radius; ++v) {
    for (int u = -radius; u <= radius; ++u) {
      if (std::abs(std::hypot(u, v) - radius) < 0.6) ring.emplace_back(u, v);
    }
  }
  return ring;
}

/// Adds round spots of a few pixels.
void findBeads(const Copy& copy, const cv::Mat& excess, cv::Mat* metal) {
  const std::vector<cv::Point> ring = ringOf(kFineRadius - 1);
  const int border = kFineRadius;
  for (int v = border; v < excess.rows - border; ++v) {
    const float* row = excess.ptr<float>(v);
    for (int u = border; u < excess.cols - border; ++u) {
      const float peak = row[u];
      if (peak < kSmallestBead || peak < row[u - 1] || peak < row[u + 1]) continue;
      if (peak < kNoiseFactor * copy.noise.at<float>(v, u) || copy.field_edge.at<std::uint8_t>(v, u) != 0) continue;
      const bool alone = std::all_of(ring.begin(), ring.end(), [&](const cv::Point& offset) {
        // Lower than the spot itself, too: the top-hat alone would take the tip of a ridge for a spot.
        const int ring_v = v + offset.y;
        const int ring_u = u + offset.x;
        const float drop = copy.attenuation.at<float>(v, u) - copy.attenuation.at<float>(ring_v, ring_u);
        return excess.at<float>(ring_v, ring_u) <= kBeadRing * peak && drop >= kBeadRing * peak;
      });
      if (alone) cv::circle(*metal, {u, v}, kRim, cv::Scalar(kUse), cv::FILLED);
    }
  }
}

cv::Mat excess(const cv::Mat& attenuation, int radius) {
  return attenuation - morphed(attenuation, cv::MORPH_OPEN, radius);
}

/// What a copy is searched for besides what is thin.
struct Search {
  bool small;  ///< Beads, letters of lead.
  bool large;  ///< Thick rods, balls.
};

/// Metal with its rim.
cv::Mat findMetal(const Copy& copy, const Search& search) {
  cv::Mat metal = cv::Mat::zeros(copy.attenuation.size(), CV_8U);
  const bool has_steps = cv::countNonZero(copy.sharp) >= kFineArea;
  // How much stands out: of what is thin, of what is large, and of beads, each over its own width.
  cv::Mat thin_excess, large_excess, bead_excess;
  cv::parallel_for_({0, 3}, [&](const cv::Range& range) {
    for (int part = range.start; part < range.end; ++part) {
      if (part == 0 && has_steps && search.large) large_excess = excess(copy.smooth, kCoarseRadius);
      if (part == 1 && has_steps) thin_excess = excess(copy.smooth, kFineRadius);
      if (part == 2 && search.small) bead_excess = excess(copy.attenuation, kFineRadius);
    }
  });
  if (has_steps) {
    std::vector<Candidates> candidates = {thinCandidates(copy, thin_excess)};
    if (search.small) {
      for (const float level : kFineLevels) candidates.push_back({thin_excess > level, kFineArea});
    }
    if (search.large) {
      for (const float level : kCoarseLevels) candidates.push_back({large_excess > level, kCoarseArea});
    }
    metal = morphed(metalAmong(copy, candidates), cv::MORPH_CLOSE, kBridge);
  }
  if (search.small) findBeads(copy, bead_excess, &metal);
  return morphed(metal, cv::MORPH_DILATE, kRim);
}

}  // namespace

cv::Mat mask_detail::metalIn(const SearchCopy& copy, const MaskImage& field, const cv::Mat& known) {
  if (copy.image().empty()) return {};
  const cv::Mat& fine_image = copy.fine();
  cv::Mat fine_field(fine_image.size(), CV_8U, cv::Scalar(kUse));
  // At the field's edge everything is sharp.
  if (!field.empty()) fine_field = mask_detail::wholeBlocks(mask_detail::view(field), copy.factor());

  const int coarse_factor = mask_detail::factorFor(fine_image.size(), kCoarseSide);
  const bool one_copy_does = coarse_factor == 1;
  if (one_copy_does) return findMetal(prepared(fine_image, fine_field, known), {true, true});
  cv::Mat metal;
  cv::Mat large;
  cv::parallel_for_({0, 2}, [&](const cv::Range& range) {
    for (int search = range.start; search < range.end; ++search) {
      if (search == 0) {
        metal = findMetal(prepared(fine_image, fine_field, known), {true, false});
      } else {
        const Copy coarse = prepared(mask_detail::shrunk(fine_image, coarse_factor),
                                     mask_detail::wholeBlocks(fine_field, coarse_factor), known);
        large =
            mask_detail::grown(findMetal(coarse, {false, true}), coarse_factor, fine_image.cols, {0, fine_image.rows});
      }
    }
  });
  metal |= large;
  return metal;
}

MaskImage metalMask(const AttenuationImage& attenuation, const MaskImage& field) {
  MaskImage result(attenuation.width(), attenuation.height(), kUse);
  const mask_detail::SearchCopy copy(attenuation);
  mask_detail::leaveOut(mask_detail::metalIn(copy, field), copy.factor(), &result);
  return result;
}

}  // namespace xray_registration

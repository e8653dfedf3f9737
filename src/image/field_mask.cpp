#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "image/mask_common.h"
#include "xray_registration/image/mask.h"

// A collimator's edge, seen from a point in the field: one sharp step to more attenuation, and nothing brighter behind
// it up to the image's border. No anatomy does both: tissue thickens gradually, and behind a bone comes less than bone.
// The step is searched along rays from the centre, and the closed contour that gathers most of it is found by dynamic
// programming over the rays, with "no edge on this ray" as an alternative.
namespace xray_registration {
namespace {

using mask_detail::kUse;

constexpr int kLongestSide = 256;  ///< Of the copy that is searched.
constexpr int kAngles = 180;
constexpr double kShareOfRange = 0.15;  ///< A step must be this share of the image's range, and
constexpr double kSmallestStep = 0.3;   ///< this much, in nepers.
constexpr double kLargestRange = 5.0;   ///< Nepers; beyond that it is zero pixels that make the range.
constexpr float kSharpness = 0.6F;      ///< Least share of the rise over 16 pixels that lies in the first two.
constexpr float kRiseCap = 2.0F;        ///< Nepers; a collimator's shadow may darken further outside.
constexpr int kFar = 16;
constexpr float kJumpCost = 0.02F;
constexpr float kSwitchCost = 3.0F;  ///< Of starting or ending a stretch of contour; the best step on a ray scores 1.5.
constexpr int kShortestRun = kAngles / 18;
constexpr int kSmallestRadius = 8;
constexpr int kBorder = 2;  ///< Pixels before the image's border where a shadow cannot be told from none.
constexpr int kNone = -1;

double stepThreshold(const cv::Mat& attenuation) {
  const mask_detail::Range range = mask_detail::percentiles(attenuation, 0.005, 0.995);
  return std::max(kSmallestStep, kShareOfRange * std::min<double>(range.high - range.low, kLargestRange));
}

/// Scores of an edge at each radius of one ray.
class Ray {
 public:
  Ray(const cv::Mat& closed, const cv::Point2d& centre, double angle, float threshold) {
    const cv::Point2d direction(std::cos(angle), std::sin(angle));
    std::vector<float> values;
    values.reserve(static_cast<std::size_t>(closed.cols + closed.rows));
    for (int r = 0;; ++r) {
      const double x = centre.x + r * direction.x;
      const double y = centre.y + r * direction.y;
      if (x <= -0.5 || y <= -0.5) break;
      // Faster than lround, and exact to what a pixel is worth here.
      const int u = static_cast<int>(x + 0.5);  // NOLINT(bugprone-incorrect-roundings)
      const int v = static_cast<int>(y + 0.5);  // NOLINT(bugprone-incorrect-roundings)
      if (u >= closed.cols || v >= closed.rows) break;
      values.push_back(closed.at<float>(v, u));
    }
    score(values, threshold);
  }

  int radii() const { return static_cast<int>(scores_.size()); }
  float at(int r) const { return scores_[static_cast<std::size_t>(r)]; }
  bool isBorder(int r) const { return r >= radii() - kBorder; }
  bool hasEdge() const {
    return std::any_of(scores_.begin(), scores_.end(), [](float value) { return value > 0.0F; });
  }

 private:
  void score(const std::vector<float>& values, float threshold) {
    const int length = static_cast<int>(values.size());
    scores_.assign(values.size(), -1.0F);
    for (int r = std::max(0, length - kBorder); r < length; ++r) scores_[static_cast<std::size_t>(r)] = 0.0F;
    float darkest_promise = std::numeric_limits<float>::infinity();  // Least attenuation from r + 2 to the border.
    for (int r = length - kBorder - 1; r >= kSmallestRadius; --r) {
      const auto at = static_cast<std::size_t>(r);
      darkest_promise = std::min(darkest_promise, values[at + 2]);
      const float inside = (values[at - 1] + values[at - 2] + values[at - 3]) / 3.0F;
      const float step = darkest_promise - inside;
      if (step < 0.5F * threshold) continue;
      const auto far_end = values.begin() + std::min(r + kFar + 1, length);
      const float rise = std::min(*std::max_element(values.begin() + r + 2, far_end) - inside, kRiseCap);
      if (values[at + 2] - inside < kSharpness * rise) continue;
      scores_[at] = std::clamp(step / threshold - 1.0F, -1.0F, 1.5F);
    }
  }

  std::vector<float> scores_;
};

/// Best way over the rays, twice around; the middle lap is free of both ends.
class ContourSearch {
 public:
  explicit ContourSearch(const std::vector<Ray>& rays) : rays_(rays) {
    for (int lap_angle = 0; lap_angle < 2 * kAngles; ++lap_angle) advance(lap_angle);
  }

  /// A radius for each ray, or kNone.
  std::array<int, kAngles> contour() const {
    std::array<int, kAngles> result{};
    result.fill(kNone);
    const std::vector<float>& last = values_;
    const auto best = std::max_element(last.begin(), last.end());
    int state = best != last.end() && *best > value_none_ ? static_cast<int>(best - last.begin()) : kNone;
    for (int lap_angle = 2 * kAngles - 1; lap_angle >= kAngles / 2; --lap_angle) {
      if (lap_angle < 3 * kAngles / 2) result[static_cast<std::size_t>(lap_angle % kAngles)] = state;
      const auto step = static_cast<std::size_t>(lap_angle);
      state = state == kNone ? from_none_[step] : from_[step][static_cast<std::size_t>(state)];
    }
    return result;
  }

 private:
  void advance(int lap_angle) {
    const Ray& ray = rays_[static_cast<std::size_t>(lap_angle % kAngles)];
    std::vector<float> values(static_cast<std::size_t>(ray.radii()), value_none_ - kSwitchCost);
    std::vector<int> from(values.size(), kNone);
    spread(&values, &from);
    for (int r = 0; r < ray.radii(); ++r) values[static_cast<std::size_t>(r)] += ray.at(r);
    int none_from = kNone;
    if (!values_.empty()) {
      const auto best = std::max_element(values_.begin(), values_.end());
      if (*best - kSwitchCost > value_none_) {
        value_none_ = *best - kSwitchCost;
        none_from = static_cast<int>(best - values_.begin());
      }
    }
    values_ = std::move(values);
    from_.push_back(std::move(from));
    from_none_.push_back(none_from);
  }

  /// For each radius the best of the last ray's values less the cost of the way to it, in two sweeps.
  void spread(std::vector<float>* values, std::vector<int>* from) const {
    float best = -std::numeric_limits<float>::infinity();
    int best_from = kNone;
    const auto sweep = [&](std::size_t r) {
      best -= kJumpCost;
      if (r < values_.size() && values_[r] > best) {
        best = values_[r];
        best_from = static_cast<int>(r);
      }
      if (r < values->size() && best > (*values)[r]) {
        (*values)[r] = best;
        (*from)[r] = best_from;
      }
    };
    const std::size_t count = std::max(values->size(), values_.size());
    for (std::size_t r = 0; r < count; ++r) sweep(r);
    best = -std::numeric_limits<float>::infinity();
    for (std::size_t r = count; r-- > 0;) sweep(r);
  }

  const std::vector<Ray>& rays_;
  std::vector<float> values_;
  float value_none_ = 0.0F;
  std::vector<std::vector<int>> from_;
  std::vector<int> from_none_;
};

/// Stretches of contour that are too short to be a blade, or that carry no step on the whole, are no edge; neither is
/// the image's border.
void dropWeakRuns(const std::vector<Ray>& rays, std::array<int, kAngles>* contour) {
  const auto at = [contour](int i) -> int& { return (*contour)[static_cast<std::size_t>(i % kAngles)]; };
  for (int i = 0; i < kAngles; ++i) {
    if (at(i) != kNone && rays[static_cast<std::size_t>(i)].isBorder(at(i))) at(i) = kNone;
  }
  int first_gap = 0;
  while (first_gap < kAngles && at(first_gap) != kNone) ++first_gap;
  for (int i = first_gap; i < first_gap + kAngles;) {
    float score = 0.0F;
    int end = i;
    for (; end < first_gap + kAngles && at(end) != kNone; ++end) {
      score += rays[static_cast<std::size_t>(end % kAngles)].at(at(end));
    }
    const int length = end - i;
    if (length < kShortestRun || score < 0.2F * static_cast<float>(length)) {
      for (int j = i; j < end; ++j) at(j) = kNone;
    }
    i = std::max(end, i + 1);
  }
}

struct Contour {
  cv::Point2d centre;
  std::array<int, kAngles> radius{};
  float score = 0.0F;  ///< 0 when no edge was found.
};

Contour findContour(const cv::Mat& closed, const cv::Point2d& centre, float threshold) {
  Contour contour{centre, {}, 0.0F};
  contour.radius.fill(kNone);
  std::vector<Ray> rays;
  rays.reserve(kAngles);
  for (int i = 0; i < kAngles; ++i) rays.emplace_back(closed, centre, 2.0 * CV_PI * i / kAngles, threshold);
  const auto with_edge = std::count_if(rays.begin(), rays.end(), [](const Ray& ray) { return ray.hasEdge(); });
  if (with_edge < kShortestRun) return contour;
  contour.radius = ContourSearch(rays).contour();
  dropWeakRuns(rays, &contour.radius);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (contour.radius[i] != kNone) contour.score += rays[i].at(contour.radius[i]);
  }
  return contour;
}

/// Centre of gravity of what is bright: inside the field even when that is small and in a corner.
cv::Point2d brightCentre(const cv::Mat& attenuation) {
  const mask_detail::Range range = mask_detail::percentiles(attenuation, 0.01, 0.99);
  cv::Mat bright = attenuation < range.low + 0.3F * (range.high - range.low);
  const cv::Moments moments = cv::moments(bright, true);
  if (moments.m00 <= 0.0) return {0.5 * attenuation.cols, 0.5 * attenuation.rows};
  return {moments.m10 / moments.m00, moments.m01 / moments.m00};
}

Contour searchField(const cv::Mat& attenuation, float threshold) {
  // Letters on the shutter are brighter than it; closing hides them. It lifts noise, but on both sides of an edge
  // alike.
  cv::Mat closed;
  cv::morphologyEx(attenuation, closed, cv::MORPH_CLOSE, cv::Mat::ones(9, 9, CV_8U), {-1, -1}, 1, cv::BORDER_REPLICATE);
  const cv::Point2d middle(0.5 * (attenuation.cols - 1), 0.5 * (attenuation.rows - 1));
  const Contour about_middle = findContour(closed, middle, threshold);
  const cv::Point2d bright = brightCentre(attenuation);
  if (cv::norm(bright - middle) < 0.1 * std::min(attenuation.cols, attenuation.rows)) return about_middle;
  const Contour about_bright = findContour(closed, bright, threshold);
  return about_bright.score > about_middle.score ? about_bright : about_middle;
}

/// With what is drawn around the field as dark as a shutter, behind which nothing is brighter.
cv::Mat darkenedOutside(const cv::Mat& attenuation, const cv::Mat& field) {
  cv::Mat result = attenuation.clone();
  double dark = 0.0;
  cv::minMaxLoc(attenuation, nullptr, &dark, nullptr, nullptr, field);
  result.setTo(dark, field == 0);
  return result;
}

/// Keeps what lies inside; one pixel of the searched copy is left to the penumbra.
void drawContour(const Contour& contour, int factor, cv::Mat* mask) {
  constexpr int kShift = 4;
  std::vector<cv::Point> polygon;
  for (int i = 0; i < kAngles; ++i) {
    const int found = contour.radius[static_cast<std::size_t>(i)];
    const double radius = found == kNone ? mask->cols + mask->rows : found - 1.0;
    const double angle = 2.0 * CV_PI * i / kAngles;
    const double u = (contour.centre.x + radius * std::cos(angle) + 0.5) * factor - 0.5;
    const double v = (contour.centre.y + radius * std::sin(angle) + 0.5) * factor - 0.5;
    polygon.emplace_back(cvRound(u * (1 << kShift)), cvRound(v * (1 << kShift)));
  }
  cv::Mat inside = cv::Mat::zeros(mask->size(), CV_8U);
  cv::fillPoly(inside, std::vector<std::vector<cv::Point>>{polygon}, cv::Scalar(kUse), cv::LINE_8, kShift);
  cv::bitwise_and(*mask, inside, *mask);
}

/// The pixels `at(0)` … `at(count - 1)` of a line parallel to an image border, thinned out where it is long.
template <typename At>
std::vector<float> samplesOf(int count, const At& at) {
  const int stride = std::max(1, count / 256);
  std::vector<float> samples;
  for (int i = 0; i < count; i += stride) samples.push_back(at(i));
  return samples;
}

/// Whether all but a seventh of the samples are above.
bool mostAreAbove(float threshold, const std::vector<float>& samples) {
  const auto below = std::count_if(samples.begin(), samples.end(), [&](float value) { return value <= threshold; });
  return below <= static_cast<std::ptrdiff_t>(samples.size() / 7);
}

/// Number of lines along one border that a thin frame covers: nearly everywhere darker than the line two further in, or
/// drawn in one value that differs from it. `line_at(i)` are samples of the border's line i.
template <typename LineAt>
int frameWidth(const LineAt& line_at, int lines, float threshold) {
  const int deepest = std::max(2, lines / 20);
  if (deepest + 2 >= lines) return 0;
  int width = 0;
  std::vector<float> darkest_promise = line_at(0);
  const float drawn_value = darkest_promise.front();
  bool is_drawn = true;
  std::vector<float> dark_step(darkest_promise.size());
  std::vector<float> drawn_step(darkest_promise.size());
  for (int i = 0; i < deepest; ++i) {
    const std::vector<float> line = line_at(i);
    const std::vector<float> inner = line_at(i + 2);
    for (std::size_t j = 0; j < line.size(); ++j) {
      darkest_promise[j] = std::min(darkest_promise[j], line[j]);
      is_drawn = is_drawn && line[j] == drawn_value;
      dark_step[j] = darkest_promise[j] - inner[j];
      drawn_step[j] = std::abs(line[j] - inner[j]);
    }
    if (mostAreAbove(threshold, dark_step) || (is_drawn && mostAreAbove(threshold, drawn_step))) width = i + 2;
  }
  return width;
}

void dropFrame(const AttenuationImage& attenuation, float threshold, cv::Mat* mask) {
  const int rows = attenuation.height();
  const int cols = attenuation.width();
  const auto row = [&](int v) { return samplesOf(cols, [&](int u) { return attenuation.at(u, v); }); };
  const auto column = [&](int u) { return samplesOf(rows, [&](int v) { return attenuation.at(u, v); }); };
  const int top = frameWidth(row, rows, threshold);
  const int bottom = frameWidth([&](int i) { return row(rows - 1 - i); }, rows, threshold);
  const int left = frameWidth(column, cols, threshold);
  const int right = frameWidth([&](int i) { return column(cols - 1 - i); }, cols, threshold);
  mask->rowRange(0, top).setTo(0);
  mask->rowRange(rows - bottom, rows).setTo(0);
  mask->colRange(0, left).setTo(0);
  mask->colRange(cols - right, cols).setTo(0);
}

}  // namespace

MaskImage mask_detail::fieldIn(const SearchCopy& copy) {
  const AttenuationImage& image = copy.image();
  MaskImage result(image.width(), image.height(), kUse);
  if (std::min(image.width(), image.height()) < 4 * kSmallestRadius) return result;
  cv::Mat mask = view(result);
  const int factor = factorFor(mask.size(), kLongestSide);
  const bool copied = factor % copy.factor() == 0;
  cv::Mat small = copied ? shrunk(copy.fine(), factor / copy.factor()) : shrunk(image, factor);
  const auto threshold = static_cast<float>(stepThreshold(small));
  cv::Mat drawn;
  Contour contour;
  // Side by side, as seldom anything is drawn.
  cv::parallel_for_({0, 2}, [&](const cv::Range& range) {
    for (int search = range.start; search < range.end; ++search) {
      if (search == 0) drawn = drawnField(image, small, factor);
      if (search == 1) contour = searchField(small, threshold);
    }
  });
  if (!drawn.empty()) {
    leaveOut(drawn == 0, factor, &result);
    small = darkenedOutside(small, drawn);
    contour = searchField(small, threshold);
  }
  if (contour.score > 0.0F) drawContour(contour, factor, &mask);
  dropFrame(image, threshold, &mask);
  return result;
}

MaskImage fieldMask(const AttenuationImage& attenuation) {
  return mask_detail::fieldIn(mask_detail::SearchCopy(attenuation));
}

}  // namespace xray_registration

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "image/mask_common.h"

// What a device draws around its picture: black or white around an intensifier's disc, bars above and below, corners
// cut off. It may be brighter than the beam, so nothing can be said of steps to more attenuation. But it is drawn:
// still where the picture is noisy, connected from the image's border on, and its edge is a disc or convex, and sharp.
// Air around a patient is as noisy as the beam; where it saturates it is still as well, but the patient's outline is
// neither sharp (it thickens gradually) nor, mostly, convex.
namespace xray_registration {
namespace {

using mask_detail::kUse;
using mask_detail::Part;
using mask_detail::Parts;

constexpr float kStill = 0.02F;                  ///< Nepers: what counts as the surround's value on the searched copy.
constexpr double kNoiseShare = 0.3;              ///< Of the picture's noise: what the surround may have.
constexpr double kRoughnessOfNoise = 6.0 * 0.8;  ///< Mean of white noise's mixed second differences, per deviation.
constexpr double kLeastNoise = 1e-4;     ///< Nepers: a picture without noise is computed, and all air is still in it.
constexpr double kLeastDisc = 0.1;       ///< Share of the image.
constexpr double kLeastConvex = 0.4;     ///< Smaller and with straight sides, it may be a box in saturated air.
constexpr double kLeastSurround = 0.01;  ///< Share of the image.
constexpr double kConvex = 0.97;         ///< Of the hull's area.
constexpr double kSharp = 0.6;           ///< Least share of the edge that is sharp, and
constexpr float kSharpness = 0.85F;      ///< of the rise over four pixels that lies in the first two there.
constexpr float kLeastStep = 0.05F;      ///< Nepers.
constexpr int kRim = 2;                  ///< Pixels at the image's border where an edge of the field is none.
constexpr double kOnCircle = 1.0;        ///< Pixels from it.
constexpr double kLeastArc = 0.4;        ///< Of the circle's part in the image.
constexpr int kCircleTries = 400;
constexpr int kLeastPoints = 40;

/// Mixed second differences, which smooth shadows do not have, of an image's noise.
cv::Mat roughness(const cv::Mat& image) {
  cv::Mat second;
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1);
  cv::filter2D(image, second, CV_32F, kernel, {-1, -1}, 0.0, cv::BORDER_REFLECT_101);
  return cv::abs(second);
}

/// A region without its rim.
cv::Mat insideOf(const cv::Mat& region) {
  cv::Mat inside;
  cv::erode(region, inside, cv::Mat(), {-1, -1}, 2, cv::BORDER_CONSTANT, cv::Scalar(kUse));
  return inside;
}

/// Mean over a region; edges count no more than four times what most pixels have.
double meanIn(const cv::Mat& rough, const cv::Mat& inside, bool cut_edges) {
  const int count = cv::countNonZero(inside);
  if (count < kLeastPoints) return std::numeric_limits<double>::infinity();
  if (!cut_edges) return cv::mean(rough, inside)[0];
  cv::Mat flat = cv::Mat::zeros(rough.size(), CV_32F);
  rough.copyTo(flat, inside);
  // Of all pixels those of the region are the largest.
  const double usual = mask_detail::percentile(flat, 1.0 - 0.25 * count / static_cast<double>(flat.total()));
  cv::min(flat, 4.0 * usual, flat);
  return cv::sum(flat)[0] / count;
}

/// The rows of an image that say what its noise is: all of a small one, else stripes of it.
std::vector<cv::Range> stripesOf(int rows) {
  constexpr int kStripe = 16;
  constexpr int kStripes = 24;
  if (rows <= kStripe * kStripes) return {{0, rows}};
  std::vector<cv::Range> stripes;
  for (int i = 0; i < kStripes; ++i) {
    const int first = (rows - kStripe) * i / (kStripes - 1);
    stripes.emplace_back(first, first + kStripe);
  }
  return stripes;
}

/// Rows of an image.
cv::Mat rowsOf(const AttenuationImage& image, const cv::Range& rows) {
  cv::Mat values(rows.size(), image.width(), CV_32F);
  std::vector<float> buffer;
  for (int v = 0; v < values.rows; ++v) {
    std::copy_n(image.row(rows.start + v, &buffer), image.width(), values.ptr<float>(v));
  }
  return values;
}

/// Whether the surround has much less noise than the beam has where it is as bright. The noise of a beam's logarithm
/// goes with the root of its brightness: air beside a dense body is stiller than the body, and is no surround. `field`
/// is that of the image's copy by `factor`.
bool isDrawn(const AttenuationImage& image, const cv::Mat& field, int factor, float value) {
  const std::vector<cv::Range> stripes = stripesOf(image.height());
  const int rim = stripes.size() > 1 ? 1 : 0;  // What lies beyond a stripe is not known to it.
  cv::Mat rough, dimmed, surround, picture;
  for (const cv::Range& stripe : stripes) {
    const cv::Mat values = rowsOf(image, stripe);
    const cv::Mat rows = mask_detail::grown(field, factor, image.width(), stripe);
    const cv::Range known(rim, values.rows - rim);
    cv::Mat dimming;
    cv::exp(0.5 * (value - values), dimming);
    const cv::Mat own = roughness(values);
    rough.push_back(own.rowRange(known));
    dimmed.push_back(cv::Mat(own.mul(dimming)).rowRange(known));
    surround.push_back(insideOf(~rows).rowRange(known));
    picture.push_back(insideOf(rows).rowRange(known));
  }
  const double found = meanIn(rough, surround, false);
  const double expected = meanIn(dimmed, picture, true) / kRoughnessOfNoise;
  return std::isfinite(expected) && expected > kLeastNoise && found / kRoughnessOfNoise < kNoiseShare * expected;
}

bool touchesBorder(const Part& part, const cv::Size& image) {
  return part.box.x == 0 || part.box.y == 0 || part.box.br().x == image.width || part.box.br().y == image.height;
}

/// The parts of `of` that `keep` likes.
template <typename Keep>
cv::Mat parts(const cv::Mat& of, const Keep& keep) {
  const Parts found = mask_detail::partsOf(of, 4);
  std::vector<std::uint8_t> kept(found.parts.size(), 0);
  for (std::size_t i = 1; i < kept.size(); ++i) kept[i] = keep(found.parts[i]) ? kUse : std::uint8_t{0};
  cv::Mat result(of.size(), CV_8U);
  for (int v = 0; v < of.rows; ++v) {
    const int* label = found.labels.ptr<int>(v);
    std::uint8_t* is_kept = result.ptr<std::uint8_t>(v);
    for (int u = 0; u < of.cols; ++u) is_kept[u] = kept[static_cast<std::size_t>(label[u])];
  }
  return result;
}

cv::Mat largestPart(const cv::Mat& of) {
  const Parts found = mask_detail::partsOf(of, 4);
  if (found.parts.size() < 2) return cv::Mat::zeros(of.size(), CV_8U);
  const auto largest = std::max_element(found.parts.begin() + 1, found.parts.end(),
                                        [](const Part& one, const Part& other) { return one.pixels < other.pixels; });
  return found.labels == static_cast<int>(largest - found.parts.begin());
}

/// What is not surround: its largest part, without holes. What is written on the surround is no field.
cv::Mat fieldWithin(const cv::Mat& small, float value) {
  const cv::Mat still = cv::abs(small - value) <= kStill;
  const double area = static_cast<double>(small.total());
  const cv::Mat surround = parts(still, [&](const Part& part) {
    return part.pixels >= kLeastSurround * area / 8.0 && touchesBorder(part, small.size());
  });
  const cv::Mat field = largestPart(~surround);
  return ~parts(~field, [&](const Part& part) { return touchesBorder(part, small.size()); });
}

/// A place on the field's edge.
struct EdgePoint {
  cv::Point2d at;
  bool is_sharp = false;
};

std::vector<EdgePoint> edgeOf(const cv::Mat& field, const cv::Mat& small, float value) {
  constexpr int kNear = 2;
  constexpr int kFar = 4;
  cv::Mat soft, slope_u, slope_v;
  cv::GaussianBlur(field, soft, {9, 9}, 2.0);
  cv::Sobel(soft, slope_u, CV_32F, 1, 0);
  cv::Sobel(soft, slope_v, CV_32F, 0, 1);
  cv::Mat step;
  cv::blur(cv::abs(small - value), step, {3, 3});  // Less noise; the places that are asked for lie far enough apart.
  const auto step_at = [&](double u, double v) {
    const int col = std::clamp(cvRound(u), 0, step.cols - 1);
    const int row = std::clamp(cvRound(v), 0, step.rows - 1);
    return step.at<float>(row, col);
  };
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(field.clone(), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<EdgePoint> edge;
  for (const std::vector<cv::Point>& contour : contours) {
    for (const cv::Point& at : contour) {
      if (at.x < kRim || at.y < kRim || at.x >= small.cols - kRim || at.y >= small.rows - kRim) continue;
      const cv::Point2d slope(slope_u.at<float>(at), slope_v.at<float>(at));
      const double length = cv::norm(slope);
      if (!(length > 0.0)) continue;
      const cv::Point2d inwards = slope / length;
      const float near = step_at(at.x + kNear * inwards.x, at.y + kNear * inwards.y);
      float far = near;
      for (int r = kNear + 1; r <= kFar; ++r) far = std::max(far, step_at(at.x + r * inwards.x, at.y + r * inwards.y));
      edge.push_back({cv::Point2d(at), near >= kLeastStep && near >= kSharpness * far});
    }
  }
  return edge;
}

std::ptrdiff_t sharpPoints(const std::vector<EdgePoint>& edge) {
  return std::count_if(edge.begin(), edge.end(), [](const EdgePoint& point) { return point.is_sharp; });
}

double sharpShare(const std::vector<EdgePoint>& edge) {
  return edge.empty() ? 0.0 : static_cast<double>(sharpPoints(edge)) / static_cast<double>(edge.size());
}

struct Circle {
  cv::Point2d centre;
  double radius = 0.0;
};

std::optional<Circle> circleThrough(const cv::Point2d& a, const cv::Point2d& b, const cv::Point2d& c) {
  const cv::Point2d p = b - a;
  const cv::Point2d q = c - a;
  const double twice_area = 2.0 * p.cross(q);
  if (std::abs(twice_area) < 1e-6) return std::nullopt;
  const cv::Point2d from_a((q.y * p.dot(p) - p.y * q.dot(q)) / twice_area,
                           (p.x * q.dot(q) - q.x * p.dot(p)) / twice_area);
  return Circle{a + from_a, cv::norm(from_a)};
}

/// The circle that lies nearest to the sharp places on this one (Kåsa's fit).
Circle refined(const Circle& circle, const std::vector<EdgePoint>& edge) {
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d right(0.0, 0.0, 0.0);
  for (const EdgePoint& point : edge) {
    const cv::Point2d at = point.at - circle.centre;
    if (!point.is_sharp || std::abs(cv::norm(at) - circle.radius) > kOnCircle) continue;
    const cv::Vec3d row(2.0 * at.x, 2.0 * at.y, 1.0);
    normal += row * row.t();
    right += at.dot(at) * row;
  }
  cv::Vec3d found;
  if (!cv::solve(normal, right, found, cv::DECOMP_CHOLESKY)) return circle;
  const double squared = found[2] + found[0] * found[0] + found[1] * found[1];
  if (!(squared > 0.0)) return circle;
  return {circle.centre + cv::Point2d(found[0], found[1]), std::sqrt(squared)};
}

/// Length of the part of a circle that lies in the image, pixels.
double arcInImage(const Circle& circle, const cv::Size& size) {
  constexpr int kSteps = 360;
  int inside = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = 2.0 * CV_PI * i / kSteps;
    const double u = circle.centre.x + circle.radius * std::cos(angle);
    const double v = circle.centre.y + circle.radius * std::sin(angle);
    inside += u >= kRim && v >= kRim && u < size.width - kRim && v < size.height - kRim ? 1 : 0;
  }
  return 2.0 * CV_PI * circle.radius * inside / kSteps;
}

/// The circle that most of the edge lies on while the rest lies inside, as where air in the field is as bright as the
/// surround. Only its sharp places count.
std::optional<Circle> discOf(const std::vector<EdgePoint>& edge, const cv::Size& size) {
  if (sharpPoints(edge) < kLeastPoints) return std::nullopt;
  const long most_outside = static_cast<long>(edge.size()) / 30;
  cv::RNG random(1);  // The same image has the same mask.
  const auto any = [&] { return edge[static_cast<std::size_t>(random.uniform(0, static_cast<int>(edge.size())))].at; };
  const double side = std::min(size.width, size.height);
  std::optional<Circle> best;
  long best_count = 0;
  for (int i = 0; i < kCircleTries; ++i) {
    const std::optional<Circle> circle = circleThrough(any(), any(), any());
    if (!circle || circle->radius < 0.2 * side || circle->radius > 1.5 * side) continue;
    long on = 0;
    long outside = 0;
    // Squares, as roots of all places would take most of the time.
    const double inner2 = std::pow(circle->radius - kOnCircle, 2);
    const double outer2 = std::pow(circle->radius + kOnCircle, 2);
    for (const EdgePoint& point : edge) {
      const cv::Point2d from_centre = point.at - circle->centre;
      const double distance2 = from_centre.dot(from_centre);
      on += distance2 >= inner2 && distance2 <= outer2 && point.is_sharp ? 1 : 0;
      outside += distance2 > outer2 ? 1 : 0;
      if (outside > most_outside) break;
    }
    if (outside > most_outside || on <= best_count) continue;
    best = circle;
    best_count = on;
  }
  if (!best || best_count < kLeastPoints || best_count < kLeastArc * arcInImage(*best, size)) return std::nullopt;
  return refined(*best, edge);
}

std::vector<cv::Point> hullOf(const cv::Mat& field) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(field.clone(), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
  std::vector<cv::Point> corners, hull;
  for (const std::vector<cv::Point>& contour : contours) corners.insert(corners.end(), contour.begin(), contour.end());
  cv::convexHull(corners, hull);
  return hull;
}

/// The field, one pixel smaller for what is half of each; empty when what surrounds it was not drawn.
cv::Mat shapeOf(const cv::Mat& field, const std::vector<EdgePoint>& edge) {
  cv::Mat shape = cv::Mat::zeros(field.size(), CV_8U);
  if (const std::optional<Circle> disc = discOf(edge, field.size())) {
    constexpr int kShift = 4;
    const cv::Point centre(cvRound(disc->centre.x * (1 << kShift)), cvRound(disc->centre.y * (1 << kShift)));
    cv::circle(shape, centre, cvRound((disc->radius + 0.5) * (1 << kShift)), cv::Scalar(kUse), cv::FILLED, cv::LINE_8,
               kShift);
  } else {
    const int pixels = cv::countNonZero(field);
    const bool is_large = pixels >= kLeastConvex * static_cast<double>(field.total());
    if (!is_large || sharpShare(edge) < kSharp) return {};
    cv::fillConvexPoly(shape, hullOf(field), cv::Scalar(kUse));
    if (pixels < kConvex * cv::countNonZero(shape)) return {};
  }
  cv::Mat smaller;
  cv::erode(shape, smaller, cv::Mat(), {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(kUse));
  return smaller;
}

/// The field that is surrounded by one value; empty when none is.
cv::Mat surroundedBy(float value, const cv::Mat& small, const AttenuationImage& image, int factor) {
  const cv::Mat field = fieldWithin(small, value);
  const int pixels = cv::countNonZero(field);
  const auto area = static_cast<double>(small.total());
  if (pixels < kLeastDisc * area || pixels > (1.0 - kLeastSurround) * area) return {};
  // First what is soon answered: the shape is looked for on the copy, the noise in the image.
  const bool noise_first = factor == 1;
  if (noise_first && !isDrawn(image, field, factor, value)) return {};
  const cv::Mat shape = shapeOf(field, edgeOf(field, small, value));
  return noise_first || shape.empty() || isDrawn(image, field, factor, value) ? shape : cv::Mat();
}

}  // namespace

cv::Mat mask_detail::drawnField(const AttenuationImage& image, const cv::Mat& small, int factor) {
  constexpr int kCorner = 3;
  if (std::min(small.cols, small.rows) < 4 * kCorner) return {};
  std::vector<float> tried;
  for (const int u : {0, small.cols - kCorner}) {
    for (const int v : {0, small.rows - kCorner}) {
      const float value = mask_detail::percentile(small(cv::Rect(u, v, kCorner, kCorner)), 0.5);
      const auto is_same = [value](float other) { return std::abs(other - value) <= kStill; };
      if (std::any_of(tried.begin(), tried.end(), is_same)) continue;
      tried.push_back(value);
      cv::Mat field = surroundedBy(value, small, image, factor);
      if (!field.empty()) return field;
    }
  }
  return {};
}

}  // namespace xray_registration

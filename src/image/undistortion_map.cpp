#include "xray_registration/image/undistortion_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "image/polynomial_surface.h"

namespace xray_registration {
namespace {

/// Hulls thinner than this hold no picture.
constexpr double kThinnestHull_px = 2.0;

std::vector<Eigen::Vector2d> hullOf(const std::vector<PixelPair>& points, const std::vector<bool>& used) {
  std::vector<cv::Point2f> flat;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (used[i]) flat.emplace_back(cv::Point2d(points[i].straight.x(), points[i].straight.y()));
  }
  std::vector<cv::Point2f> corners;
  cv::convexHull(flat, corners);
  std::vector<Eigen::Vector2d> hull;
  hull.reserve(corners.size());
  for (const cv::Point2f& corner : corners) hull.emplace_back(corner.x, corner.y);
  const cv::Size2f box = cv::minAreaRect(corners).size;
  if (hull.size() < 3 || std::min(box.width, box.height) < kThinnestHull_px) {
    throw UndistortionMapError("the points lie on a line; a map needs some all over the picture");
  }
  return hull;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

Eigen::Vector2d nearestOnEdge(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& point) {
  const Eigen::Vector2d along = b - a;
  const double share = along.dot(point - a) / std::max(along.squaredNorm(), 1e-12);
  return a + std::min(std::max(share, 0.0), 1.0) * along;
}

Eigen::Vector2d nearestOnHull(const std::vector<Eigen::Vector2d>& hull, const Eigen::Vector2d& point) {
  Eigen::Vector2d nearest = hull.front();
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d candidate = nearestOnEdge(hull[i], hull[(i + 1) % hull.size()], point);
    const double its_distance = (candidate - point).squaredNorm();
    if (its_distance < distance) {
      distance = its_distance;
      nearest = candidate;
    }
  }
  return nearest;
}

class ResidualSum {
 public:
  void add(const Eigen::Vector2d& difference) {
    squares_ += difference.squaredNorm();
    largest_ = std::max(largest_, difference.norm());
    ++count_;
  }
  PixelResidual residual() const { return {count_ > 0 ? std::sqrt(squares_ / count_) : 0.0, largest_}; }

 private:
  double squares_ = 0.0;
  double largest_ = 0.0;
  int count_ = 0;
};

UndistortionFit summary(const std::vector<PixelPair>& points, const SurfaceFit& fit) {
  UndistortionFit result;
  ResidualSum before;
  ResidualSum after;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!fit.used[i]) continue;
    const Eigen::Vector2d displacement = points[i].raw - points[i].straight;
    before.add(displacement);
    after.add(displacement - fit.surface.at(points[i].straight));
    ++result.points_used;
  }
  result.used = fit.used;
  result.before = before.residual();
  result.after = after.residual();
  result.cross_validated_rms_px = fit.cross_validated_rms;
  return result;
}

}  // namespace

UndistortionMap UndistortionMap::fitted(int width, int height, const std::vector<PixelPair>& points,
                                        UndistortionFit* fit) {
  if (points.size() < kFewestSamples) {
    throw UndistortionMapError(std::to_string(points.size()) +
                               " points are too few for an undistortion map; at least " +
                               std::to_string(kFewestSamples));
  }
  std::vector<PlaneSample> samples;
  samples.reserve(points.size());
  for (const PixelPair& point : points) samples.push_back({point.straight, point.raw - point.straight});
  const SurfaceFit surface = fitSurface(samples);
  UndistortionMap map;
  map.width_ = width;
  map.height_ = height;
  map.hull_ = hullOf(points, surface.used);
  map.displacement_ = std::make_shared<const PolynomialSurface>(surface.surface);
  if (fit != nullptr) *fit = summary(points, surface);
  return map;
}

int UndistortionMap::degree() const { return displacement_->degree; }

Eigen::Vector2d UndistortionMap::rawPixel(const Eigen::Vector2d& straight) const {
  return straight + displacement_->at(covers(straight) ? straight : nearestOnHull(hull_, straight));
}

bool UndistortionMap::covers(const Eigen::Vector2d& straight) const {
  // Convex: inside is on one and the same side of every edge.
  bool left = false;
  bool right = false;
  for (std::size_t i = 0; i < hull_.size(); ++i) {
    const Eigen::Vector2d& a = hull_[i];
    const double side = cross(hull_[(i + 1) % hull_.size()] - a, straight - a);
    left = left || side > 0.0;
    right = right || side < 0.0;
    if (left && right) return false;
  }
  return true;
}

}  // namespace xray_registration

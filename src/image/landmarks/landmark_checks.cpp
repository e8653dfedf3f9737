#include "image/landmarks/landmark_checks.h"

#include <Eigen/SVD>

namespace xray_registration {
namespace {

constexpr double kSamePoint_mm = 0.5;
constexpr double kSamePixel_px = 0.5;
// Of the points' second extent to their first: below, a turn about their line moves no pixel by what a click is off.
constexpr double kLine = 0.02;

bool isSamePoint(const Landmark& a, const Landmark& b) { return (a.point_ct - b.point_ct).norm() < kSamePoint_mm; }

void checkPair(const std::vector<Landmark>& landmarks, std::size_t i, std::size_t j) {
  const Landmark& a = landmarks[i];
  const Landmark& b = landmarks[j];
  const std::string both = nameOf(landmarks, i) + " and " + nameOf(landmarks, j);
  if (a.view == b.view && isSamePoint(a, b)) throw LandmarkError(both + " are the same point of the CT");
  if (a.view == b.view && (a.pixel - b.pixel).norm() < kSamePixel_px)
    throw LandmarkError(both + " have the same pixel");
  if (!a.name.empty() && a.name == b.name && a.view != b.view && !isSamePoint(a, b)) {
    throw LandmarkError(both + " are one name for two points of the CT");
  }
}

std::vector<Eigen::Vector3d> differentPoints(const std::vector<Landmark>& landmarks) {
  std::vector<Eigen::Vector3d> points;
  for (const Landmark& landmark : landmarks) {
    bool is_new = true;
    for (const auto& point : points) is_new = is_new && (point - landmark.point_ct).norm() >= kSamePoint_mm;
    if (is_new) points.push_back(landmark.point_ct);
  }
  return points;
}

}  // namespace

std::string nameOf(const std::vector<Landmark>& landmarks, std::size_t index) {
  const std::string& name = landmarks[index].name;
  return name.empty() ? "point number " + std::to_string(index + 1) : "point '" + name + "'";
}

bool areCollinear(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < 3) return true;
  Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) all.col(static_cast<Eigen::Index>(i)) = points[i];
  all.colwise() -= all.rowwise().mean().eval();
  const Eigen::Vector3d extent = Eigen::JacobiSVD<Eigen::Matrix3Xd>(all).singularValues().head<3>();
  return extent[1] < kLine * extent[0];
}

void checkLandmarks(const std::vector<Landmark>& landmarks, const std::vector<LandmarkView>& views) {
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].view >= views.size()) throw std::invalid_argument(nameOf(landmarks, i) + " is of no known view");
    if (!landmarks[i].point_ct.allFinite() || !landmarks[i].pixel.allFinite()) {
      throw std::invalid_argument(nameOf(landmarks, i) + " has numbers that are not finite");
    }
    for (std::size_t j = 0; j < i; ++j) checkPair(landmarks, j, i);
  }
  const auto points = differentPoints(landmarks);
  const bool one_view = views.size() < 2;
  if (landmarks.size() < 4 || points.size() < 3) {
    throw LandmarkError(
        std::to_string(landmarks.size()) + (landmarks.size() == 1 ? " point is" : " points are") +
        " too few: " + (one_view ? "a view needs four" : "views need four, or three seen in two of them"));
  }
  if (areCollinear(points)) throw LandmarkError("the points lie on a line, about which the CT could be turned at will");
}

}  // namespace xray_registration

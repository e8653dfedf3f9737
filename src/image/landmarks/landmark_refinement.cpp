#include "image/landmarks/landmark_refinement.h"

#include <Eigen/Cholesky>
#include <limits>

namespace xray_registration {
namespace {

constexpr int kMostSteps = 50;
constexpr double kMostDamping = 1e8;
constexpr double kConverged = 1e-12;  // Share of the cost.

Eigen::Vector3d centreOf(const std::vector<Landmark>& landmarks, const std::vector<bool>& chosen) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (!chosen[i]) continue;
    sum += landmarks[i].point_ct;
    ++count;
  }
  return sum / std::max(count, 1);
}

double costOf(const std::vector<Landmark>& landmarks, const std::vector<bool>& chosen,
              const std::vector<LandmarkView>& views, const RigidTransform& T_first_ct) {
  double cost = 0.0;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (!chosen[i]) continue;
    const double residual = landmarkResidual(landmarks[i], views, T_first_ct);
    cost += residual * residual;
  }
  return cost;
}

/// Derivative of a landmark's pixel by a twist about `centre`, both in the first camera.
Eigen::Matrix<double, 2, 6> pixelByTwist(const LandmarkView& view, const Eigen::Vector3d& point_first,
                                         const Eigen::Vector3d& centre) {
  const Eigen::Vector3d p = view.T_view_first * point_first;
  Eigen::Matrix<double, 2, 3> pixel_by_point;
  pixel_by_point << view.camera.fx / p.z(), 0.0, -view.camera.fx * p.x() / (p.z() * p.z()), 0.0, view.camera.fy / p.z(),
      -view.camera.fy * p.y() / (p.z() * p.z());
  const Eigen::Vector3d arm = point_first - centre;
  Eigen::Matrix<double, 3, 6> point_by_twist;
  point_by_twist.leftCols<3>().setIdentity();
  // ω × arm = −arm × ω
  point_by_twist.rightCols<3>() << 0.0, arm.z(), -arm.y(), -arm.z(), 0.0, arm.x(), arm.y(), -arm.x(), 0.0;
  return pixel_by_point * view.T_view_first.linear() * point_by_twist;
}

}  // namespace

double landmarkResidual(const Landmark& landmark, const std::vector<LandmarkView>& views,
                        const RigidTransform& T_first_ct) {
  const LandmarkView& view = views[landmark.view];
  const Eigen::Vector3d point = view.T_view_first * (T_first_ct * landmark.point_ct);
  if (!(point.z() > 0.0)) return std::numeric_limits<double>::infinity();
  return (view.camera.project(point) - landmark.pixel).norm();
}

RigidTransform refinedPose(const std::vector<Landmark>& landmarks, const std::vector<bool>& chosen,
                           const std::vector<LandmarkView>& views, RigidTransform T_first_ct) {
  const Eigen::Vector3d centre_ct = centreOf(landmarks, chosen);
  double cost = costOf(landmarks, chosen, views, T_first_ct);
  double damping = 1e-3;
  for (int step = 0; step < kMostSteps && damping < kMostDamping; ++step) {
    const Eigen::Vector3d centre = T_first_ct * centre_ct;
    Matrix6d normal = Matrix6d::Zero();
    Twist gradient = Twist::Zero();
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      if (!chosen[i]) continue;
      const LandmarkView& view = views[landmarks[i].view];
      const Eigen::Vector3d point = T_first_ct * landmarks[i].point_ct;
      const auto jacobian = pixelByTwist(view, point, centre);
      const Eigen::Vector2d residual = view.camera.project(view.T_view_first * point) - landmarks[i].pixel;
      normal += jacobian.transpose() * jacobian;
      gradient += jacobian.transpose() * residual;
    }
    Matrix6d damped = normal;
    damped.diagonal() *= 1.0 + damping;
    const Twist twist = damped.ldlt().solve(-gradient);
    const RigidTransform tried = updatedPose(T_first_ct, twist, centre);
    const double tried_cost = twist.allFinite() ? costOf(landmarks, chosen, views, tried) : cost + 1.0;
    if (tried_cost > cost) {
      damping *= 10.0;
      continue;
    }
    const bool is_done = cost - tried_cost <= kConverged * cost;
    T_first_ct = tried;
    cost = tried_cost;
    damping *= 0.1;
    if (is_done) break;
  }
  return T_first_ct;
}

}  // namespace xray_registration

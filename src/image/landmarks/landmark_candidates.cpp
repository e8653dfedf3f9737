#include "image/landmarks/landmark_candidates.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>

#include "image/landmarks/landmark_checks.h"

namespace xray_registration {
namespace {

constexpr int kRansacRounds = 1000;
constexpr double kRansacConfidence = 0.999;

/// The landmarks of one view as OpenCV takes them.
struct ViewPoints {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
};

ViewPoints pointsOf(const std::vector<Landmark>& landmarks, std::size_t view) {
  ViewPoints all;
  for (const Landmark& landmark : landmarks) {
    if (landmark.view != view) continue;
    all.points.emplace_back(landmark.point_ct.x(), landmark.point_ct.y(), landmark.point_ct.z());
    all.pixels.emplace_back(landmark.pixel.x(), landmark.pixel.y());
  }
  return all;
}

RigidTransform poseOf(const cv::Mat& rotation, const cv::Mat& translation) {
  RigidTransform pose = RigidTransform::Identity();
  const Eigen::Vector3d turn(rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2));
  pose.linear() = rotationFromVector(turn);
  pose.translation() << translation.at<double>(0), translation.at<double>(1), translation.at<double>(2);
  return pose;
}

cv::Matx33d matrixOf(const XrayCamera& camera) {
  return {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
}

/// All poses of all triples; four or five points have ten at most.
void addP3p(const ViewPoints& view, const cv::Matx33d& camera, std::vector<RigidTransform>* poses) {
  const std::size_t count = view.points.size();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      for (std::size_t k = j + 1; k < count; ++k) {
        const std::vector<cv::Point3d> points = {view.points[i], view.points[j], view.points[k]};
        const std::vector<cv::Point2d> pixels = {view.pixels[i], view.pixels[j], view.pixels[k]};
        std::vector<cv::Mat> rotations, translations;
        cv::solveP3P(points, pixels, camera, cv::noArray(), rotations, translations, cv::SOLVEPNP_P3P);
        for (std::size_t s = 0; s < rotations.size(); ++s) poses->push_back(poseOf(rotations[s], translations[s]));
      }
    }
  }
}

void addRansac(const ViewPoints& view, const cv::Matx33d& camera, double inlier_px,
               std::vector<RigidTransform>* poses) {
  for (const int method : {cv::SOLVEPNP_EPNP, cv::SOLVEPNP_P3P}) {
    cv::Mat rotation, translation;
    const bool found =
        cv::solvePnPRansac(view.points, view.pixels, camera, cv::noArray(), rotation, translation, false, kRansacRounds,
                           static_cast<float>(inlier_px), kRansacConfidence, cv::noArray(), method);
    if (found) poses->push_back(poseOf(rotation, translation));
  }
}

/// The point where two rays come closest, in the first camera.
Eigen::Vector3d crossing(const Landmark& a, const LandmarkView& view_a, const Landmark& b, const LandmarkView& view_b) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const auto add = [&sum, &right](const Landmark& landmark, const LandmarkView& view) {
    const RigidTransform T_first_view = view.T_view_first.inverse();
    const Eigen::Vector3d direction =
        (T_first_view.linear() * view.camera.rayDirection(landmark.pixel.x(), landmark.pixel.y())).normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
    sum += across;
    right += across * T_first_view.translation();
  };
  add(a, view_a);
  add(b, view_b);
  return sum.inverse() * right;
}

/// The rigid motion between pairs of points (Kabsch).
RigidTransform motionBetween(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to) {
  Eigen::Vector3d from_centre = Eigen::Vector3d::Zero(), to_centre = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    from_centre += from[i] / static_cast<double>(from.size());
    to_centre += to[i] / static_cast<double>(from.size());
  }
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) products += (to[i] - to_centre) * (from[i] - from_centre).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  RigidTransform motion = RigidTransform::Identity();
  motion.linear() = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  motion.translation() = to_centre - motion.linear() * from_centre;
  return motion;
}

/// From points that two views see.
void addCrossings(const std::vector<Landmark>& landmarks, const std::vector<LandmarkView>& views,
                  std::vector<RigidTransform>* poses) {
  std::vector<Eigen::Vector3d> in_ct, in_first;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (landmarks[i].view == landmarks[j].view || landmarks[i].name.empty()) continue;
      if (landmarks[i].name != landmarks[j].name) continue;
      in_ct.push_back(landmarks[i].point_ct);
      in_first.push_back(crossing(landmarks[i], views[landmarks[i].view], landmarks[j], views[landmarks[j].view]));
      break;
    }
  }
  if (!areCollinear(in_ct)) poses->push_back(motionBetween(in_ct, in_first));
}

}  // namespace

std::vector<RigidTransform> landmarkCandidates(const std::vector<Landmark>& landmarks,
                                               const std::vector<LandmarkView>& views, double inlier_px) {
  std::vector<RigidTransform> poses;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ViewPoints view = pointsOf(landmarks, i);
    std::vector<RigidTransform> in_view;
    const cv::Matx33d camera = matrixOf(views[i].camera);
    if (view.points.size() >= 6) {
      addRansac(view, camera, inlier_px, &in_view);
    } else if (view.points.size() >= 4) {
      addP3p(view, camera, &in_view);
    }
    for (const RigidTransform& pose : in_view) poses.push_back(views[i].T_view_first.inverse() * pose);
  }
  addCrossings(landmarks, views, &poses);
  return poses;
}

}  // namespace xray_registration

#pragma once

// A CT with two bones that move on their own, as files, and its X-rays in two views.

#include <array>
#include <string>
#include <vector>

#include "scene.h"
#include "xray_registration/volume/body_cut.h"

namespace xray_registration {

/// Six bones that stay where they are, and two of several parts each (labels 1 and 2), apart in both views. None looks
/// like itself from another side.
inline LabelledPhantom boneBox() {
  const auto bone = [](const Eigen::Vector3d& centre, const Eigen::Vector3d& axes, double hu,
                       const Eigen::Vector3d& turn, int label) {
    return PhantomEllipsoid{centre, axes, rotationFromVector(turn), hu, label};
  };
  std::vector<PhantomEllipsoid> shapes = {
      bone({0, 0, 0}, {105, 78, 138}, 40, {0, 0, 0}, 0),        bone({62, 5, 62}, {9, 30, 12}, 800, {0.3, 0.2, 0.5}, 0),
      bone({-66, 0, -58}, {12, 26, 9}, 900, {0.5, -0.3, 0}, 0), bone({-60, -20, 75}, {8, 8, 30}, 700, {0.2, 0.6, 0}, 0),
      bone({66, 15, -70}, {8, 10, 28}, 800, {-0.3, 0.4, 0}, 0), bone({0, 45, 5}, {40, 8, 10}, 700, {0, 0.3, 0.2}, 0),
      bone({5, -50, -5}, {12, 9, 30}, 900, {0.4, 0, 0.3}, 0)};
  const auto add = [&](const Eigen::Vector3d& at, double side, int label) {
    shapes.push_back(bone(at, {22, 16, 14}, 900, {0, 0.2 * side, 0.1}, label));
    shapes.push_back(bone(at + Eigen::Vector3d(side * 6, -20, 10), {6, 16, 6}, 1100, {0.4, 0, 0.3 * side}, label));
    shapes.push_back(bone(at + Eigen::Vector3d(side * -18, 10, 16), {7, 7, 18}, 1200, {0.2, 0.5 * side, 0}, label));
    shapes.push_back(bone(at + Eigen::Vector3d(side * 16, 8, -16), {9, 6, 12}, 1000, {-0.4, 0.3, 0}, label));
  };
  add({-10, 0, 55}, 1.0, 1);
  add({12, 4, -55}, -1.0, 2);
  VolumeGrid grid;
  grid.size = {96, 72, 120};
  grid.spacing_mm = {2.5, 2.5, 2.5};
  grid.origin_ct_mm = {-120, -90, -150};
  LabelledPhantom phantom;
  phantom.ct = paintPhantom(grid, shapes);
  phantom.labels = paintLabels(phantom.ct, shapes);
  return phantom;
}

/// Two cameras, 60° apart, that look at a point 800 mm away.
class TwoCameras {
 public:
  TwoCameras() {
    camera_.width = camera_.height = 192;
    camera_.fx = camera_.fy = 500.0;
    camera_.cx = camera_.cy = 95.5;
  }

  static RigidTransform viewFromFirst(std::size_t view) {
    RigidTransform T = RigidTransform::Identity();
    if (view == 0) return T;
    const Eigen::Vector3d point(0, 0, 800);
    T.linear() = rotationFromVector(Eigen::Vector3d(0, M_PI / 3.0, 0));
    T.translation() = point - T.linear() * point;
    return T;
  }

  /// From the front: what is at `centre_mm` in the object's frame (LPS) is at the point that both look at.
  static RigidTransform lookingAt(const Eigen::Vector3d& centre_mm) {
    Eigen::Matrix3d R;
    R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    RigidTransform T = RigidTransform::Identity();
    T.linear() = R;
    T.translation() = Eigen::Vector3d(0, 0, 800) - R * centre_mm;
    return T;
  }

  /// `parts`: posed in the first camera.
  sensor_msgs::Image image(std::vector<PosedVolume> parts, std::size_t view, const ros::Time& stamp,
                           const std::string& frame_id) const {
    for (PosedVolume& part : parts) part.T_camera_volume = viewFromFirst(view) * part.T_camera_volume;
    std::mt19937_64 random(42 + view + stamp.toNSec());  // Noise makes every image another.
    return imageMessage(simulateXray(parts, camera_, XrayPhysics{}, &random), stamp, frame_id);
  }
  sensor_msgs::CameraInfo info(const std_msgs::Header& header) const { return infoMessage(camera_, header); }

 private:
  XrayCamera camera_;
};

class BodyScene {
 public:
  /// Writes the CT and its labels where test/ros/bodies.test tells the node that they are.
  BodyScene() {
    const LabelledPhantom phantom = boneBox();
    writeVolume(phantom.ct, ctPath());
    Volume labels = phantom.ct;
    labels.hu.assign(phantom.labels.labels.begin(), phantom.labels.labels.end());
    writeVolume(labels, labelsPath());
    parts_ = cutBodies(phantom.ct, AttenuationModel{}, phantom.labels, {{1}, {2}});
    centre_ct_ = anatomicalCentreCt(toAttenuation(phantom.ct, AttenuationModel{}));
  }
  ~BodyScene() {
    std::error_code ignored;
    std::filesystem::remove(ctPath(), ignored);
    std::filesystem::remove(labelsPath(), ignored);
  }
  BodyScene(const BodyScene&) = delete;
  BodyScene& operator=(const BodyScene&) = delete;

  static std::string ctPath() { return inTemporaries("xray_registration_bodies_ct.nii.gz"); }
  static std::string labelsPath() { return inTemporaries("xray_registration_bodies_labels.nii.gz"); }

  /// Slowly moving.
  RigidTransform pose(int number) const {
    const RigidTransform T = TwoCameras::lookingAt(centre_ct_);
    Twist twist;
    twist << 1.2 * number, -0.8 * number, 0.5 * number, 0.003 * number, 0.005 * number, -0.004 * number;
    return updatedPose(T, twist, T * centre_ct_);
  }

  /// Off by 2.2 mm and 1.4°.
  RigidTransform disturbed(const RigidTransform& T_camera_ct) const {
    Twist twist;
    twist << 1.5, -1.5, 0.5, 0.015, -0.015, 0.01;
    return updatedPose(T_camera_ct, twist, T_camera_ct * centre_ct_);
  }

  Eigen::Vector3d centreOf(std::size_t body) const { return anatomicalCentreCt(parts_.bodies[body]); }

  /// Where a body is in the CT's frame: 1.5 mm and 1.5° from where the CT has it, and so far along the CT's long axis.
  RigidTransform moved(std::size_t body, double along_mm) const {
    Twist twist;
    twist << 1.0 - 2.0 * static_cast<double>(body), 0.5, 1.0 + along_mm, 0.02, 0.01, -0.01;
    return updatedPose(RigidTransform::Identity(), twist, centreOf(body));
  }

  double error(std::size_t body, const RigidTransform& found, const RigidTransform& truth) const {
    return (found * centreOf(body) - truth * centreOf(body)).norm();
  }

  std::vector<PosedVolume> parts(const RigidTransform& T_camera_ct,
                                 const std::array<RigidTransform, 2>& T_ct_bodies) const {
    return {{&parts_.rest, T_camera_ct},
            {&parts_.bodies[0], T_camera_ct * T_ct_bodies[0]},
            {&parts_.bodies[1], T_camera_ct * T_ct_bodies[1]}};
  }

 private:
  static std::string inTemporaries(const std::string& name) {
    return (std::filesystem::temp_directory_path() / name).string();
  }

  CutCt parts_;
  Eigen::Vector3d centre_ct_ = Eigen::Vector3d::Zero();
};

}  // namespace xray_registration

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "xray_registration/pipeline/start_check.h"

namespace xray_registration {
namespace {

const XrayCamera kCamera{96, 96, 300.0, 300.0, 47.5, 47.5};

/// Spheres in three arms of different length and thickness: another shape from every side.
FloatImage render(const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  const std::vector<std::pair<Eigen::Vector3d, double>> spheres = {
      {{0, -90, 0}, 22.0}, {{0, -50, 0}, 22.0}, {{0, -10, 0}, 22.0}, {{0, 30, 0}, 22.0},
      {{0, 70, 0}, 22.0},  {{45, 75, 0}, 18.0}, {{80, 75, 0}, 18.0}, {{0, -90, 50}, 14.0}};
  FloatImage image(camera.width, camera.height);
  for (const auto& [centre_mm, radius_mm] : spheres) {
    const Eigen::Vector3d point = T_camera_ct * centre_mm;
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const Eigen::Vector3d ray = camera.rayDirection(u, v).normalized();
        const double distance_mm = ray.cross(point).norm();
        if (distance_mm < radius_mm)
          image.at(u, v) += static_cast<float>(std::sqrt(radius_mm * radius_mm - distance_mm * distance_mm));
      }
    }
  }
  return image;
}

RigidTransform truth() {
  RigidTransform T = RigidTransform::Identity();
  T.linear() = rotationFromVector(Eigen::Vector3d(0.3, -0.2, 0.1));
  T.translation() = Eigen::Vector3d(5.0, -8.0, 700.0);
  return T;
}

ViewInput xray() {
  XrayFrame frame;
  frame.camera = kCamera;
  frame.attenuation = render(kCamera, truth());
  frame.mask = MaskImage(kCamera.width, kCamera.height, 255);
  return ViewInput(std::move(frame));
}

/// The truth, turned about and moved from where it is.
RigidTransform off(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm = Eigen::Vector3d::Zero()) {
  RigidTransform T = truth();
  T.linear() = rotationFromVector(turn_rad) * T.linear();
  T.translation() += shift_mm;
  return T;
}

std::string problem(const RigidTransform& start) { return turnedStart(start, Eigen::Vector3d::Zero(), xray(), render); }

TEST(TurnedStart, LeavesWhatASearchMayArriveFrom) {
  EXPECT_EQ(problem(truth()), "");
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(problem(off({sign * 0.15, 0.15, -sign * 0.15}, {sign * 15.0, 15.0, -sign * 15.0})), "");
  }
}

TEST(TurnedStart, NamesTheTurn) {
  const struct {
    Eigen::Vector3d turn;
    const char* words;
  } cases[] = {{{0, 0, M_PI_2}, "turned by -90 degrees about the camera's z axis"},
               {{0, 0, -M_PI_2}, "turned by 90 degrees about the camera's z axis"},
               {{M_PI_2, 0, 0}, "turned by -90 degrees about the camera's x axis"},
               {{0, M_PI_2, 0}, "turned by -90 degrees about the camera's y axis"}};
  for (const auto& one : cases) {
    const std::string text = problem(off(one.turn, {8.0, -8.0, 10.0}));
    EXPECT_NE(text.find(one.words), std::string::npos) << one.words << ": " << text;
  }
}

TEST(TurnedStart, SaysNothingOfAnotherCt) {
  XrayFrame frame;
  frame.camera = kCamera;
  frame.attenuation = FloatImage(kCamera.width, kCamera.height);
  for (int i = 0; i < kCamera.width * kCamera.height; ++i) {
    frame.attenuation.floats().pixels[static_cast<std::size_t>(i)] =
        static_cast<float>((i / 7) % 5 + (i / kCamera.width / 9) % 3);
  }
  frame.mask = MaskImage(kCamera.width, kCamera.height, 255);
  EXPECT_EQ(turnedStart(truth(), Eigen::Vector3d::Zero(), ViewInput(std::move(frame)), render), "");
}

TEST(TurnedStart, SaysNothingWithoutADrr) {
  const auto none = [](const XrayCamera&, const RigidTransform&) { return FloatImage(); };
  EXPECT_EQ(turnedStart(truth(), Eigen::Vector3d::Zero(), xray(), none), "");
}

}  // namespace
}  // namespace xray_registration

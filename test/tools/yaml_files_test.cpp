#include "tools/common/yaml_files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

namespace xray_registration::tools {
namespace {

std::string written(const std::string& text) {
  const std::string path = testing::TempDir() + "yaml_files_test.yaml";
  std::ofstream(path) << text;
  return path;
}

std::string refusal(const std::string& text, bool camera) {
  try {
    camera ? static_cast<void>(readCameraFile(written(text))) : static_cast<void>(readPoseFile(written(text)));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(CameraFile, ComesBackAsWritten) {
  const XrayCamera camera{320, 200, 1234.5, 1230.25, 158.125, 101.0};
  const std::string path = testing::TempDir() + "camera.yaml";
  writeCameraFile(path, "lateral", camera);
  EXPECT_EQ(readCameraFile(path), camera);  // Written with all digits.
}

TEST(CameraFile, ShortFormFromDistances) {
  const XrayCamera camera =
      readCameraFile(written("{width: 200, height: 100, source_detector_mm: 1000, pixel_mm: 0.5}"));
  EXPECT_DOUBLE_EQ(camera.fx, 2000.0);
  EXPECT_DOUBLE_EQ(camera.fy, 2000.0);
  EXPECT_DOUBLE_EQ(camera.cx, 99.5);
  EXPECT_DOUBLE_EQ(camera.cy, 49.5);
}

TEST(CameraFile, ShortFormFromFocalLengths) {
  const XrayCamera camera = readCameraFile(written("{width: 200, height: 100, fx: 900, fy: 901, cx: 90, cy: 40}"));
  EXPECT_EQ(camera, (XrayCamera{200, 100, 900.0, 901.0, 90.0, 40.0}));
}

TEST(CameraFile, RefusalsNameFileAndKey) {
  EXPECT_NE(refusal("{width: 200, fx: 900}", true).find("'height' is missing"), std::string::npos);
  EXPECT_NE(refusal("{width: 200, height: 1.5, fx: 900}", true).find("'height' must be a whole number"),
            std::string::npos);
  EXPECT_NE(refusal("{width: 200, height: 10, fx: much}", true).find("'fx' is not a number"), std::string::npos);
  EXPECT_NE(refusal("{width: 200, height: 10, fx: .nan}", true).find("'fx' is not finite"), std::string::npos);
  EXPECT_NE(refusal("{width: 200, height: 10, fx: -3}", true).find("yaml_files_test.yaml: "), std::string::npos);
  EXPECT_NE(refusal("a: [", true).find("is not YAML"), std::string::npos);
  EXPECT_NE(refusal("just words", true).find("holds no keys"), std::string::npos);
  EXPECT_NE(refusal("{image_width: 9, image_height: 9, camera_matrix: {data: [1, 0, 4]}}", true).find("9 numbers"),
            std::string::npos);
  EXPECT_NE(refusal("{image_width: 9, image_height: 9, camera_matrix: {data: [9, 0, 4, 0, 9, 4, 0, 0, 1]}, "
                    "distortion_coefficients: {data: [0.1, 0, 0, 0, 0]}}",
                    true)
                .find("distortion"),
            std::string::npos);
}

TEST(CameraFile, MissingFileIsNamed) {
  try {
    readCameraFile("/no/such/camera.yaml");
    FAIL() << "a missing file was read";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "/no/such/camera.yaml: cannot be opened");
  }
}

TEST(PoseFile, ComesBackAsWritten) {
  RigidTransform pose = updatedPose(RigidTransform::Identity(),
                                    (Twist() << 10.0, -20.0, 812.0, 0.3, -1.1, 0.2).finished(), {5.0, 6.0, 7.0});
  const std::string path = testing::TempDir() + "pose.yaml";
  writePoseFile(path, pose);
  // Quaternion and back costs a few units in the last place, times 812 mm.
  EXPECT_TRUE(readPoseFile(path).isApprox(pose, 1e-12));
}

TEST(PoseFile, MetresBecomeMillimetres) {
  const RigidTransform pose = readPoseFile(written("{position: [0.1, 0.2, 0.8], orientation: [0, 0, 1, 0]}"));
  EXPECT_TRUE(pose.translation().isApprox(Eigen::Vector3d(100.0, 200.0, 800.0)));
  EXPECT_TRUE((pose.linear() * Eigen::Vector3d::UnitX()).isApprox(-Eigen::Vector3d::UnitX()));
}

TEST(PoseFile, MatrixAndConfigurationForms) {
  const std::string matrix = "T_camera_ct_mm: [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 700], [0, 0, 0, 1]]";
  EXPECT_TRUE(readPoseFile(written(matrix)).translation().isApprox(Eigen::Vector3d(5.0, 6.0, 700.0)));
  const std::string nested = "initial_pose: {position: [0, 0, 0.7], orientation: [0, 0, 0, 1]}";
  EXPECT_DOUBLE_EQ(readPoseFile(written(nested)).translation().z(), 700.0);
}

TEST(PoseFile, RefusalsNameTheKey) {
  EXPECT_NE(refusal("{orientation: [0, 0, 0, 1]}", false).find("'position'"), std::string::npos);
  EXPECT_NE(refusal("{position: [0, 0, 1]}", false).find("'orientation'"), std::string::npos);
  EXPECT_NE(refusal("{position: [0, 0], orientation: [0, 0, 0, 1]}", false).find("3 numbers, not 2"),
            std::string::npos);
  EXPECT_NE(refusal("{position: [0, 0, .inf], orientation: [0, 0, 0, 1]}", false).find("not finite"),
            std::string::npos);
  EXPECT_NE(refusal("{position: [0, 0, 1], orientation: [0, 0, 0, 2]}", false).find("length 1 is needed"),
            std::string::npos);
  EXPECT_NE(refusal("T_camera_ct_mm: [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]", false).find("T_camera_ct_mm"),
            std::string::npos);
}

}  // namespace
}  // namespace xray_registration::tools

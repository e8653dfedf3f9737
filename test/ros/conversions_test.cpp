#include "xray_registration/ros/conversions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace xray_registration {
namespace {

template <typename T>
sensor_msgs::Image message(const std::string& encoding, int width, int height, const std::vector<T>& values,
                           bool big_endian, std::size_t padding) {
  sensor_msgs::Image image;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.encoding = encoding;
  image.is_bigendian = big_endian ? 1 : 0;
  image.step = static_cast<std::uint32_t>(width * sizeof(T) + padding);
  image.data.assign(static_cast<std::size_t>(image.step) * image.height, 0xEE);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      std::uint8_t bytes[sizeof(T)];
      std::memcpy(bytes, &values[static_cast<std::size_t>(v) * width + u], sizeof(T));
      // The test runs on little-endian machines only, which is what the expectation below is written for.
      if (big_endian) std::reverse(bytes, bytes + sizeof(T));
      std::memcpy(&image.data[static_cast<std::size_t>(v) * image.step + u * sizeof(T)], bytes, sizeof(T));
    }
  }
  return image;
}

template <typename T>
void expectRead(const std::string& encoding, const std::vector<T>& values, double saturation) {
  for (const bool big_endian : {false, true}) {
    for (const std::size_t padding : {0U, 1U, 13U}) {
      const RawImage raw = rawImage(message(encoding, 3, 2, values, big_endian, padding));
      ASSERT_EQ(raw.pixels.width(), 3);
      ASSERT_EQ(raw.pixels.height(), 2);
      EXPECT_EQ(raw.saturation, saturation);
      for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_EQ(floatsOf(raw.pixels).pixels[i], static_cast<float>(values[i]))
            << encoding << " big endian " << big_endian;
      }
    }
  }
}

TEST(TfFrame, HasNoLeadingSlash) {
  EXPECT_EQ(tfFrame("/xray_optical"), "xray_optical");
  EXPECT_EQ(tfFrame("carm/xray_optical"), "carm/xray_optical");
  EXPECT_EQ(tfFrame(""), "");
  EXPECT_EQ(tfFrame("/"), "");
}

TEST(RawImage, ReadsEveryEncodingEndiannessAndRowStep) {
  const std::vector<std::uint8_t> bytes{0, 1, 127, 128, 200, 255};
  const std::vector<std::uint16_t> words{0, 1, 255, 256, 40000, 65535};
  const std::vector<float> floats{0.0F, -1.5F, 3.25F, 1e-20F, 1e20F, 65536.5F};
  for (const char* encoding : {"mono8", "8UC1"}) expectRead(encoding, bytes, 255.0);
  for (const char* encoding : {"mono16", "16UC1"}) expectRead(encoding, words, 65535.0);
  expectRead("32FC1", floats, static_cast<double>(std::numeric_limits<float>::max()));
}

std::string reasonOf(const sensor_msgs::Image& image) {
  try {
    rawImage(image);
  } catch (const FrameError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(RawImage, RefusesWhatItCannotReadInWords) {
  const std::vector<std::uint16_t> words(6, 7);
  const sensor_msgs::Image good = message("mono16", 3, 2, words, false, 2);
  EXPECT_EQ(reasonOf(good), "accepted");

  sensor_msgs::Image bad = good;
  bad.encoding = "rgb8";
  EXPECT_NE(reasonOf(bad).find("'rgb8'"), std::string::npos);
  bad = good;
  bad.width = 0;
  EXPECT_NE(reasonOf(bad).find("0x2"), std::string::npos);
  bad = good;
  bad.step = 5;
  EXPECT_NE(reasonOf(bad).find("step 5"), std::string::npos);
  bad = good;
  bad.data.resize(13);  // One byte short of the last row's end.
  EXPECT_NE(reasonOf(bad).find("13 bytes"), std::string::npos);
  bad = good;
  bad.data.resize(14);  // The last row's padding may be missing.
  EXPECT_EQ(reasonOf(bad), "accepted");
  bad = good;
  bad.width = bad.height = 4000000000U;  // No overflow, no huge allocation.
  EXPECT_NE(reasonOf(bad).find("4000000000"), std::string::npos);
}

TEST(Calibration, CopiesCameraInfo) {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  info.K = {1200, 0, 320, 0, 1100, 240, 0, 0, 1};
  info.D = {0.1, 0.2, 0.3, 0.4, 0.5};
  info.distortion_model = "plumb_bob";
  info.binning_x = 0;
  info.binning_y = 2;
  info.roi.x_offset = 10;
  info.roi.y_offset = 20;
  info.roi.width = 100;
  info.roi.height = 80;
  const Calibration result = calibration(info);
  EXPECT_EQ(result.width, 640);
  EXPECT_EQ(result.height, 480);
  EXPECT_EQ(result.k[4], 1100.0);
  EXPECT_EQ(result.distortion.size(), 5U);
  EXPECT_EQ(result.distortion_model, "plumb_bob");
  EXPECT_EQ(result.binning_x, 1);  // 0 means 1 in ROS.
  EXPECT_EQ(result.binning_y, 2);
  EXPECT_EQ(result.roi_x, 10);
  EXPECT_EQ(result.roi_height, 80);
}

RigidTransform somePose() {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector(Eigen::Vector3d(0.3, -2.0, 0.7));
  pose.translation() = Eigen::Vector3d(-12.5, 340.0, 1002.25);
  return pose;
}

TEST(Poses, GoToMetresAndBack) {
  const geometry_msgs::Pose pose = toPose(somePose());
  EXPECT_DOUBLE_EQ(pose.position.z, 1.00225);
  // Rounding of a quaternion in double.
  EXPECT_TRUE(fromPose(pose).isApprox(somePose(), 1e-12));
  EXPECT_TRUE(fromTransform(toTransform(somePose())).isApprox(somePose(), 1e-12));
}

TEST(Poses, AreRefusedWithTheirName) {
  geometry_msgs::Pose pose = toPose(somePose());
  pose.position.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fromPose(pose, "start"), std::invalid_argument);
  pose = geometry_msgs::Pose();  // A default message has the quaternion 0.
  try {
    fromPose(pose, "start");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("start"), std::string::npos);
  }
}

TEST(Covariance, IsThatOfTheOriginInMetres) {
  // Twists drawn from the solver's covariance move the CT's origin and axes; their sample covariance must be what the
  // conversion states.
  const RigidTransform T_camera_ct = somePose();
  const Eigen::Vector3d centre_ct(20.0, -30.0, 150.0);
  Eigen::Matrix<double, 6, 1> deviations;
  deviations << 0.05, 0.02, 1.0, 1e-4, 3e-4, 2e-4;
  const Matrix6d covariance = deviations.array().square().matrix().asDiagonal();
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  Matrix6d sampled = Matrix6d::Zero();
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    Twist twist;
    for (int k = 0; k < 6; ++k) twist[k] = deviations[k] * normal(random);
    const RigidTransform moved = updatedPose(T_camera_ct, twist, T_camera_ct * centre_ct);
    Eigen::Matrix<double, 6, 1> difference;
    difference.head<3>() = (moved.translation() - T_camera_ct.translation()) * 1e-3;
    difference.tail<3>() = vectorFromRotation(moved.linear() * T_camera_ct.linear().transpose());
    sampled += difference * difference.transpose() / kSamples;
  }
  const Matrix6d stated = poseCovariance(covariance, T_camera_ct, centre_ct);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      // Sampling error of a covariance: about sqrt(2 / 20000) = 1 % of the deviations' product; five of them.
      const double scale = std::sqrt(stated(row, row) * stated(column, column));
      EXPECT_NEAR(sampled(row, column), stated(row, column), 0.05 * scale) << row << "," << column;
    }
  }
}

TEST(ImageMessages, KeepValues) {
  FloatImage image(2, 1);
  image.pixels = {1.0F, 3.0F};
  const sensor_msgs::Image floats = toFloatMessage(image);
  EXPECT_EQ(rawImage(floats).pixels.floats.pixels, image.pixels);
  const sensor_msgs::Image grey = toDisplayMessage(image);
  EXPECT_EQ(grey.encoding, "mono8");
  EXPECT_EQ(grey.data, (std::vector<std::uint8_t>{0, 255}));
  EXPECT_EQ(toDisplayMessage(FloatImage(2, 1, 5.0F)).data, (std::vector<std::uint8_t>{0, 0}));
}

TEST(ToColourMessage, IsRgb8RowByRow) {
  RgbImage image(3, 2);
  image.at(2, 1) = {1, 2, 3};
  image.at(0, 0) = {4, 5, 6};
  const sensor_msgs::Image colour = toColourMessage(image);
  EXPECT_EQ(colour.encoding, "rgb8");
  EXPECT_EQ(colour.width, 3U);
  EXPECT_EQ(colour.height, 2U);
  EXPECT_EQ(colour.step, 9U);
  ASSERT_EQ(colour.data.size(), 18U);
  EXPECT_EQ(colour.data[0], 4);
  EXPECT_EQ(colour.data[17], 3);
}

TEST(SinceZero, IsExact) {
  EXPECT_EQ(sinceZero(ros::Time(4294967295U, 999999999U)).count(), 4294967295999999999LL);
  EXPECT_EQ(sinceZero(ros::Time()).count(), 0);
}

}  // namespace
}  // namespace xray_registration

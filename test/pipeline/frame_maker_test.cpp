#include "xray_registration/pipeline/frame_maker.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "test/pipeline/fake_registrar.h"

namespace xray_registration {
namespace {

/// Nothing is searched for, so that masks are those of the test.
ImageParameters plain() {
  ImageParameters options;
  options.find = {false, false, false};
  return options;
}

class Maker : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("frame_maker_test_" + std::to_string(getpid()));
    std::filesystem::create_directory(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// An image of one value but for one pixel that is not to be used.
  std::string writeMask(const std::string& name, int width, int height, int u, int v) const {
    cv::Mat mask(height, width, CV_8U, cv::Scalar(255));
    mask.at<std::uint8_t>(v, u) = 0;
    const std::string path = (folder_ / name).string();
    cv::imwrite(path, mask);
    return path;
  }

  /// A detector of the given size that shows everything `shift_px` too far to the right.
  std::string writeMap(const std::string& name, int width, int height, double shift_px) const {
    std::vector<PixelPair> pairs;
    for (int v = 0; v < height; v += 4) {
      for (int u = 0; u < width; u += 4) pairs.push_back({Eigen::Vector2d(u + shift_px, v), Eigen::Vector2d(u, v)});
    }
    const std::string path = (folder_ / name).string();
    UndistortionMap::fitted(width, height, pairs).write(path);
    return path;
  }

  std::filesystem::path folder_;
};

TEST_F(Maker, MakesTheSameFrameAsTheImageRoom) {
  FrameMaker maker(plain(), {""});
  RawView raw = someView();
  raw.T_view_first.translation().x() = 7.0;
  const XrayFrame expected = makeXrayFrame(raw.image->pixels, 65535.0, raw.calibration, {});
  const FrameViews frame = maker.make({raw});
  ASSERT_TRUE(frame.views.at(0)) << frame.problem;
  EXPECT_TRUE(frame.problem.empty());
  EXPECT_EQ(frame.used, std::vector<std::string>{""});
  EXPECT_TRUE(frame.missing.empty());
  EXPECT_EQ(frame.views[0]->xray->attenuation.values().pixels, expected.attenuation.values().pixels);
  EXPECT_EQ(frame.views[0]->xray->mask.pixels, expected.mask.pixels);
  EXPECT_TRUE(frame.views[0]->xray->camera == expected.camera);
  EXPECT_EQ(frame.views[0]->T_view_first.translation().x(), 7.0);
  EXPECT_GT(frame.prepare_ms, 0.0);
}

TEST_F(Maker, PixelsThatAreMovedInAreNotCopied) {
  FrameMaker maker(plain(), {""});
  std::vector<RawView> views = {someView()};
  const float* pixels = views[0].image->pixels.floats.pixels.data();
  const FrameViews frame = maker.make(std::move(views));
  ASSERT_TRUE(frame.views.at(0));
  EXPECT_EQ(frame.views[0]->xray->attenuation.plain()->pixels.data(), pixels);
}

TEST_F(Maker, SaysWhatIsWrongWithEachView) {
  FrameMaker maker(plain(), {"a", "b", "c"});
  std::vector<RawView> views = {someView("a"), someView("b"), someView("c")};
  views[0].calibration.k[0] = 0.0;
  views[2].image.reset();
  views[2].problem = "image encoding 'rgb8' is not one of mono8";
  const FrameViews frame = maker.make(views);
  EXPECT_FALSE(frame.views[0]);
  EXPECT_TRUE(frame.views[1]);
  EXPECT_FALSE(frame.views[2]);
  EXPECT_EQ(frame.used, std::vector<std::string>{"b"});
  EXPECT_EQ(frame.missing, (std::vector<std::string>{"a", "c"}));
  EXPECT_NE(frame.problem.find("view 'a'"), std::string::npos) << frame.problem;
  EXPECT_NE(frame.problem.find("view 'c': image encoding 'rgb8'"), std::string::npos) << frame.problem;
}

TEST_F(Maker, WithoutViewsThereIsAProblem) {
  FrameMaker maker(plain(), {""});
  EXPECT_FALSE(maker.make({}).problem.empty());
  RawView silent = someView();
  silent.image.reset();
  EXPECT_FALSE(maker.make({silent}).problem.empty());
}

TEST_F(Maker, EachViewHasItsOwnMaskOrThatOfAll) {
  ImageParameters options = plain();
  options.mask = writeMask("all.png", 32, 24, 3, 4);
  options.masks["b"] = writeMask("b.png", 32, 24, 20, 10);
  FrameMaker maker(options, {"a", "b"});
  const FrameViews frame = maker.make({someView("a"), someView("b")});
  ASSERT_TRUE(frame.problem.empty()) << frame.problem;
  EXPECT_EQ(frame.views[0]->xray->mask.at(3, 4), 0);
  EXPECT_NE(frame.views[0]->xray->mask.at(20, 10), 0);
  EXPECT_NE(frame.views[1]->xray->mask.at(3, 4), 0);
  EXPECT_EQ(frame.views[1]->xray->mask.at(20, 10), 0);
}

TEST_F(Maker, AMaskOfAnotherSizeIsNamedWithBothSizes) {
  ImageParameters options = plain();
  options.mask = writeMask("small.png", 16, 12, 0, 0);
  FrameMaker maker(options, {""});
  const std::string problem = maker.make({someView()}).problem;
  EXPECT_NE(problem.find("32x24"), std::string::npos) << problem;
  EXPECT_NE(problem.find("16x12"), std::string::npos) << problem;
}

TEST_F(Maker, UnreadableMasksAreNamed) {
  ImageParameters options;
  options.mask = "/nowhere/mask.png";
  options.masks["b"] = "/nowhere/b.png";
  for (const std::string view : {"a", "b"}) {
    try {
      FrameMaker maker(options, {view});
      FAIL() << view;
    } catch (const ParameterError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(view == "b" ? "image/masks/b" : "image/mask"), std::string::npos) << text;
      EXPECT_NE(text.find("/nowhere/"), std::string::npos) << text;
    }
  }
}

TEST_F(Maker, EachViewHasItsOwnUndistortionMapOrThatOfAll) {
  ImageParameters options = plain();
  options.undistortion_map = writeMap("all.yaml", 32, 24, 1.0);
  options.undistortion_maps["b"] = writeMap("b.yaml", 32, 24, 3.0);
  FrameMaker maker(options, {"a", "b"});
  const XrayFrame raw = makeXrayFrame(someView().image->pixels, 65535.0, someView().calibration, {});
  for (int repeat = 0; repeat < 2; ++repeat) {
    const FrameViews frame = maker.make({someView("a"), someView("b")});
    ASSERT_TRUE(frame.problem.empty()) << frame.problem;
    for (const auto& [view, shift] : {std::make_pair(0, 1), std::make_pair(1, 3)}) {
      const XrayFrame& straight = *frame.views[static_cast<std::size_t>(view)]->xray;
      // The marks reach from the first pixel to the last multiple of four. Numbers of the fit round by 1e-12 px.
      for (int v = 1; v < 20; ++v) {
        for (int u = 1; u < 28; ++u) {
          ASSERT_NEAR(straight.attenuation.at(u, v), raw.attenuation.at(u + shift, v), 1e-5);
          ASSERT_NE(straight.mask.at(u, v), 0);
        }
      }
      EXPECT_EQ(straight.mask.at(30, 10), 0) << "beyond the marks";
    }
  }
}

TEST_F(Maker, AnUndistortionMapOfAnotherSizeIsNamedWithBothSizes) {
  ImageParameters options = plain();
  options.undistortion_map = writeMap("small.yaml", 16, 12, 0.0);
  FrameMaker maker(options, {""});
  const std::string problem = maker.make({someView()}).problem;
  for (const char* word : {"32 × 24", "16 × 12", "image/undistortion_map"}) {
    EXPECT_NE(problem.find(word), std::string::npos) << problem;
  }
}

TEST_F(Maker, UnreadableUndistortionMapsAreNamed) {
  ImageParameters options;
  options.undistortion_map = "/nowhere/map.yaml";
  options.undistortion_maps["b"] = writeMask("mask.png", 32, 24, 0, 0);
  for (const std::string view : {"a", "b"}) {
    try {
      FrameMaker maker(options, {view});
      FAIL() << view;
    } catch (const ParameterError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(view == "b" ? "image/undistortion_maps/b" : "image/undistortion_map"), std::string::npos);
      EXPECT_NE(text.find(view == "b" ? "mask.png" : "/nowhere/map.yaml"), std::string::npos) << text;
    }
  }
}

TEST_F(Maker, ViewsWithDifferentLensesKeepTheirOwn) {
  FrameMaker maker(plain(), {"a", "b"});
  std::vector<RawView> views = {someView("a"), someView("b")};
  views[0].calibration.distortion = {-0.2, 0.0, 0.0, 0.0, 0.0};
  views[1].calibration.distortion = {0.3, 0.0, 0.0, 0.0, 0.0};
  for (RawView& view : views) {
    view.calibration.distortion_model = "plumb_bob";
    view.calibration.k = {40, 0, 15.5, 0, 40, 11.5, 0, 0, 1};
  }
  for (int repeat = 0; repeat < 2; ++repeat) {
    const FrameViews frame = maker.make(views);
    ASSERT_TRUE(frame.problem.empty()) << frame.problem;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const XrayFrame expected = makeXrayFrame(views[i].image->pixels, 65535.0, views[i].calibration, {});
      EXPECT_EQ(frame.views[i]->xray->attenuation.values().pixels, expected.attenuation.values().pixels)
          << "view " << i;
    }
  }
}

TEST_F(Maker, AnInvertedImageInFloatsHasItsOwnLargestValue) {
  ImageParameters options = plain();
  options.linearize.kind = ImageKind::kInverted;
  RawView raw = someView();
  const FloatImage pixels = raw.image->pixels.floats;
  const double largest = *std::max_element(pixels.pixels.begin(), pixels.pixels.end());
  raw.image->saturation = static_cast<double>(std::numeric_limits<float>::max());
  FrameMaker maker(options, {""});
  const FrameViews frame = maker.make({raw});
  ASSERT_TRUE(frame.views.at(0)) << frame.problem;
  EXPECT_EQ(frame.views[0]->xray->attenuation.values().pixels,
            makeXrayFrame(pixels, largest, raw.calibration, options.linearize).attenuation.values().pixels);
}

}  // namespace
}  // namespace xray_registration

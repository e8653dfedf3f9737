#include "registration/discrete_hypotheses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace xray_registration {
namespace {

const Eigen::Vector3d kCentreCt(5.0, 7.0, 9.0);

/// Every pixel has a value of its own, and so has the camera's centre.
ViewInput view(const std::string& name, float offset) {
  XrayFrame frame;
  frame.camera = {4, 4, 100.0, 100.0, 1.2, 1.7};
  frame.attenuation = FloatImage(4, 4);
  frame.mask = MaskImage(4, 4, 1);
  for (std::size_t i = 0; i < 16; ++i) frame.attenuation.floats().pixels[i] = offset + static_cast<float>(i + 1);
  frame.mask.at(1, 0) = 0;
  ViewInput input{std::move(frame)};
  input.name = name;
  return input;
}

std::vector<ViewInput> twoViews() {
  std::vector<ViewInput> views = {view("ap", 0.0F), view("oblique", 100.0F)};
  views[1].T_view_first.linear() = rotationFromVector({0.1, 0.7, -0.2});
  views[1].T_view_first.translation() = Eigen::Vector3d(-400.0, 20.0, 100.0);
  return views;
}

RigidTransform start() {
  RigidTransform T = RigidTransform::Identity();
  T.linear() = rotationFromVector({0.3, -0.2, 0.5});
  T.translation() = Eigen::Vector3d(10.0, -20.0, 900.0);
  return T;
}

std::size_t indexOf(const DiscreteHypotheses& hypotheses, const std::string& words) {
  for (std::size_t i = 0; i < hypotheses.all().size(); ++i) {
    if (hypotheses.all()[i].in_words == words) return i;
  }
  throw std::runtime_error("no hypothesis in the words: " + words);
}

PutRight putRight(const std::string& words, const std::vector<ViewInput>& views) {
  const DiscreteHypotheses hypotheses({"ap", "oblique"});
  return hypotheses.putRight(indexOf(hypotheses, words), views, start(), start(), kCentreCt);
}

FloatImage imageOf(const PutRight& right, std::size_t view) { return right.views[view].xray->attenuation.values(); }

TEST(DiscreteHypotheses, AMirroredImageIsMirroredBackAndItsCameraStays) {
  const std::vector<ViewInput> views = twoViews();
  const PutRight right = putRight("the X-ray of the view 'oblique' looks mirrored left to right", views);
  EXPECT_EQ(imageOf(right, 0).pixels, views[0].xray->attenuation.values().pixels);
  EXPECT_EQ(imageOf(right, 1).at(0, 2), views[1].xray->attenuation.at(3, 2));
  EXPECT_EQ(right.views[1].xray->mask.at(2, 0), 0);
  EXPECT_EQ(right.views[1].xray->camera, views[1].xray->camera);
  EXPECT_TRUE(right.T_camera_ct_start.isApprox(start()));
}

TEST(DiscreteHypotheses, UpsideDownExchangesRowsAlone) {
  const std::vector<ViewInput> views = twoViews();
  const PutRight right = putRight("the X-ray looks mirrored upside down", views);
  for (std::size_t v = 0; v < 2; ++v) EXPECT_EQ(imageOf(right, v).at(1, 0), views[v].xray->attenuation.at(1, 3));
}

TEST(DiscreteHypotheses, WhatWasTurnedClockwiseIsTurnedBack) {
  const std::vector<ViewInput> views = twoViews();
  const PutRight right = putRight("the X-ray looks turned by 90 degrees clockwise", views);
  // Clockwise a first row becomes the last column; back, the last column becomes the first row.
  EXPECT_EQ(imageOf(right, 0).at(1, 0), views[0].xray->attenuation.at(3, 1));
  const PutRight other = putRight("the X-ray looks turned by 90 degrees counterclockwise", views);
  EXPECT_EQ(imageOf(other, 0).at(3, 1), views[0].xray->attenuation.at(1, 0));
  const PutRight half = putRight("the X-ray looks turned by 180 degrees", views);
  EXPECT_EQ(imageOf(half, 0).at(1, 0), views[0].xray->attenuation.at(2, 3));
}

TEST(DiscreteHypotheses, AnInvertedImageIsInverted) {
  const std::vector<ViewInput> views = twoViews();
  const PutRight right = putRight("the X-ray of the view 'ap' looks inverted", views);
  EXPECT_EQ(imageOf(right, 0).at(2, 1), -views[0].xray->attenuation.at(2, 1));
  EXPECT_EQ(imageOf(right, 1).pixels, views[1].xray->attenuation.values().pixels);
}

TEST(DiscreteHypotheses, ExchangedViewsKeepTheirPoses) {
  const std::vector<ViewInput> views = twoViews();
  const PutRight right = putRight("the views 'ap' and 'oblique' look exchanged", views);
  EXPECT_EQ(imageOf(right, 0).pixels, views[1].xray->attenuation.values().pixels);
  EXPECT_EQ(imageOf(right, 1).pixels, views[0].xray->attenuation.values().pixels);
  EXPECT_TRUE(right.views[1].T_view_first.isApprox(views[1].T_view_first));
}

// The right CT is the told one in a mirror: where its points are seen in the images as they came, the told CT's points
// are seen in the images put right.
TEST(DiscreteHypotheses, AMirroredCtIsSeenInAMirror) {
  const std::vector<ViewInput> views = twoViews();
  const PutRight right = putRight("the CT looks mirrored", views);
  const Eigen::Vector3d told(12.0, -4.0, 20.0);
  const Eigen::Vector3d true_ct(2.0 * kCentreCt.x() - told.x(), told.y(), told.z());
  for (std::size_t v = 0; v < 2; ++v) {
    const Eigen::Vector2d came = views[v].xray->camera.project(views[v].T_view_first * start() * true_ct);
    const Eigen::Vector2d put =
        right.views[v].xray->camera.project(right.views[v].T_view_first * right.T_camera_ct_start * told);
    EXPECT_NEAR(put.x(), 3.0 - came.x(), 1e-9) << "view " << v;
    EXPECT_NEAR(put.y(), came.y(), 1e-9) << "view " << v;
    EXPECT_TRUE(isRigid(right.views[v].T_view_first.matrix(), 1e-9));
  }
  EXPECT_TRUE(isRigid(right.T_camera_ct_start.matrix(), 1e-9));
}

TEST(DiscreteHypotheses, OneViewIsNotAskedAboutOthers) {
  const DiscreteHypotheses hypotheses({""});
  for (const DiscreteHypothesis& hypothesis : hypotheses.all()) {
    EXPECT_NE(hypothesis.what, "exchanged_views");
    EXPECT_NE(hypothesis.what, "mirrored_ct");  // In one view it is a mirrored image.
    EXPECT_EQ(hypothesis.in_words.find("of the view"), std::string::npos) << hypothesis.in_words;
  }
}

/// A body that is the same left and right (CT x = ±), as points.
std::vector<Eigen::Vector3d> twinPoints() {
  std::vector<Eigen::Vector3d> points;
  for (const double side : {-1.0, 1.0}) {
    points.push_back(kCentreCt + Eigen::Vector3d(side * 20.0, 10.0, 30.0));
    points.push_back(kCentreCt + Eigen::Vector3d(side * 40.0, -50.0, 5.0));
  }
  return points;
}

/// What was found in a mirrored X-ray of such a body is its mirror image; from there the right pose has to come out.
TEST(DiscreteHypotheses, AMirroredImageOfWhatIsAlikeOnBothSidesIsSeenFromTheOther) {
  const DiscreteHypotheses hypotheses({""});
  const ViewInput seen = view("", 0.0F);
  const XrayCamera camera = seen.xray->camera;
  const std::string words = "the X-ray looks mirrored, and the CT seen from its other side";
  // The pose in whose mirrored image the points lie as start() has them.
  const PutRight right = hypotheses.putRight(indexOf(hypotheses, words) + 1, {seen}, start(), start(), kCentreCt);
  const auto mirrored = [&](const Eigen::Vector2d& pixel) {
    return Eigen::Vector2d(camera.width - 1 - pixel.x(), pixel.y());
  };
  for (const Eigen::Vector3d& point : twinPoints()) {
    const Eigen::Vector2d expected = camera.project(start() * point);
    double nearest = 1e9;
    for (const Eigen::Vector3d& twin : twinPoints()) {
      nearest = std::min(nearest, (mirrored(camera.project(right.T_camera_ct_start * twin)) - expected).norm());
    }
    // Exact where the principal point is in the middle; else the centre is.
    EXPECT_LT(nearest, 0.02 * camera.fx);
  }
}

TEST(DiscreteHypotheses, FromBehindIsAHalfTurnAboutTheVertical) {
  const DiscreteHypotheses hypotheses({""});
  const std::string words = "the X-ray looks mirrored, and the CT seen from its other side";
  const PutRight right = hypotheses.putRight(indexOf(hypotheses, words), {view("", 0.0F)}, start(), start(), kCentreCt);
  const Eigen::Matrix3d turn = right.T_camera_ct_start.linear() * start().linear().transpose();
  EXPECT_TRUE(turn.isApprox(Eigen::Vector3d(-1.0, 1.0, -1.0).asDiagonal().toDenseMatrix(), 1e-9)) << turn;
  EXPECT_NEAR((right.T_camera_ct_start * kCentreCt).z(), (start() * kCentreCt).z(), 1e-9);
  EXPECT_EQ(imageOf(right, 0).at(0, 2), view("", 0.0F).xray->attenuation.at(3, 2));
}

}  // namespace
}  // namespace xray_registration

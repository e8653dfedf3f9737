#include "registration/setup.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

const Eigen::Vector3d kCentreCt(10.0, -20.0, 300.0);

Setup twoViews() {
  Setup setup;
  setup.T_camera_ct.linear() = rotationFromVector({0.2, -0.4, 0.1});
  setup.T_camera_ct.translation() = Eigen::Vector3d(3.0, 5.0, 800.0);
  setup.views.resize(2);
  setup.views[1].T_view_first.linear() = rotationFromVector({0.0, 0.8, 0.1});
  setup.views[1].T_view_first.translation() = Eigen::Vector3d(-500.0, 10.0, 200.0);
  return setup;
}

TEST(SetUps, ADifferenceCarriesOneSetupToAnother) {
  const xray_registration::Setup setup = twoViews();
  const SetupLayout layout(2);
  Eigen::VectorXd correction = Eigen::VectorXd::Zero(layout.size());
  correction.segment<6>(SetupLayout::kPose) << 1.0, -2.0, 3.0, 0.01, 0.02, -0.03;
  correction.segment<6>(SetupLayout::kStrain) << 0.01, 0.02, -0.01, 0.001, 0.002, -0.003;
  for (std::size_t view = 0; view < 2; ++view) {
    correction[layout.of(view, SetupLayout::kFocal)] = 0.02 + 0.01 * static_cast<double>(view);
    correction.segment<2>(layout.of(view, SetupLayout::kCentre)) << 3.0, -4.0;
  }
  correction.segment<6>(layout.of(1, SetupLayout::kViewPose)) << -0.5, 0.6, 0.7, -0.02, 0.01, 0.005;
  const xray_registration::Setup moved = corrected(setup, correction, kCentreCt);
  // Everything is exact: the difference undoes what was applied, in the same order of motions.
  EXPECT_LT((setupDifference(setup, moved, kCentreCt) - correction).norm(), 1e-9);
  EXPECT_LT(setupDifference(moved, moved, kCentreCt).norm(), 1e-12);
}

TEST(SetUps, TheFirstViewIsTheFrameOfThePoseAndHasNoPoseOfItsOwn) {
  const SetupLayout layout(2);
  Eigen::VectorXd correction = Eigen::VectorXd::Zero(layout.size());
  correction.segment<6>(layout.of(0, SetupLayout::kViewPose)).setOnes();
  const xray_registration::Setup moved = corrected(twoViews(), correction, kCentreCt);
  EXPECT_TRUE(moved.views[0].T_view_first.isApprox(RigidTransform::Identity()));
}

TEST(SetUps, ParametersDoNotOverlap) {
  const SetupLayout layout(3);
  EXPECT_EQ(layout.of(0, 0), SetupLayout::kStrain + 6);
  EXPECT_EQ(layout.of(1, 0), layout.of(0, SetupLayout::kViewPose) + 6);
  EXPECT_EQ(layout.size(), layout.of(2, SetupLayout::kViewPose) + 6);
}

}  // namespace
}  // namespace xray_registration

#include "registration/cold_start.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

const Eigen::Vector3d kCentre{10.0, 20.0, 30.0};

Attempt attempt(double x_mm, double similarity, bool failed = false) {
  Attempt made;
  made.solution.T_camera_ct.translation() = Eigen::Vector3d(x_mm, 0.0, 800.0);
  made.solution.sums.similarity = similarity;
  made.solution.failed = failed;
  return made;
}

double placeOf(const Attempt& attempt) { return attempt.solution.T_camera_ct.translation().x(); }

TEST(Attempts, TheMostAlikeIsBest) {
  Attempts attempts(kCentre);
  attempts.add(attempt(0.0, 0.5));
  EXPECT_EQ(placeOf(attempts.best()), 0.0);
  attempts.add(attempt(5.0, 0.7));
  attempts.add(attempt(9.0, 0.6));
  EXPECT_EQ(placeOf(attempts.best()), 5.0);
}

TEST(Attempts, OneThatFailedIsNeverBestBesideOneThatDidNot) {
  Attempts attempts(kCentre);
  attempts.add(attempt(0.0, 0.9, true));
  EXPECT_EQ(placeOf(attempts.best()), 0.0);  // There is nothing else; the verdict sees that it failed.
  attempts.add(attempt(5.0, 0.3));
  EXPECT_EQ(placeOf(attempts.best()), 5.0);
  attempts.add(attempt(7.0, 0.8, true));
  EXPECT_EQ(placeOf(attempts.best()), 5.0);
}

TEST(Attempts, AgreementIsTheNearestOtherOne) {
  Attempts attempts(kCentre);
  attempts.add(attempt(0.0, 0.7));
  EXPECT_GT(attempts.disagreementMm(), 1e6);
  attempts.add(attempt(4.0, 0.5));
  EXPECT_NEAR(attempts.disagreementMm(), 4.0, 1e-9);
  attempts.add(attempt(0.5, 0.6));
  EXPECT_NEAR(attempts.disagreementMm(), 0.5, 1e-9);
}

TEST(Attempts, OneThatFailedConfirmsNothing) {
  Attempts attempts(kCentre);
  attempts.add(attempt(0.0, 0.7));
  attempts.add(attempt(0.1, 0.7, true));
  EXPECT_GT(attempts.disagreementMm(), 1e6);
  Attempts all_failed(kCentre);
  all_failed.add(attempt(0.0, 0.7, true));
  all_failed.add(attempt(0.0, 0.7, true));
  EXPECT_GT(all_failed.disagreementMm(), 1e6);
}

TEST(Attempts, WhatFoundTheBestAgainConfirmsItAndIsNotTheBest) {
  Attempts attempts(kCentre);
  attempts.add(attempt(0.0, 0.6));
  attempts.add(attempt(20.0, 0.5));
  EXPECT_NEAR(attempts.distanceMm(attempt(0.3, 0.65)), 0.3, 1e-9);
  EXPECT_GT(attempts.distanceMm(attempt(0.3, 0.65, true)), 1e6);
  attempts.addConfirmation(attempt(0.3, 0.65));  // On a coarser level, where more is alike.
  EXPECT_EQ(placeOf(attempts.best()), 0.0);
  EXPECT_NEAR(attempts.disagreementMm(), 0.3, 1e-9);
  EXPECT_EQ(attempts.rival().similarity, 0.5);
}

TEST(Attempts, TheRivalIsTheMostAlikeOfWhatWasFoundElsewhere) {
  Attempts attempts(kCentre);
  attempts.add(attempt(0.0, 0.7));
  EXPECT_EQ(attempts.rival().similarity, -1.0);
  attempts.addRival(attempt(1.0, 0.69));  // The same place.
  EXPECT_EQ(attempts.rival().similarity, -1.0);
  attempts.addRival(attempt(20.0, 0.5));
  attempts.add(attempt(30.0, 0.6));
  attempts.addRival(attempt(40.0, 0.65, true));  // Failed.
  EXPECT_EQ(attempts.rival().similarity, 0.6);
  EXPECT_NEAR(attempts.rival().distance_mm, 30.0, 1e-9);
}

TEST(Attempts, WhatIsOutOfReachIsNeitherBestNorARival) {
  Reach reach;
  reach.T_camera_ct_start.translation() = Eigen::Vector3d(0.0, 0.0, 800.0);
  reach.translation_mm = 12.0;
  Attempts attempts(kCentre, reach);
  attempts.add(attempt(0.0, 0.6));
  attempts.add(attempt(30.0, 0.9));
  attempts.addRival(attempt(-25.0, 0.59));
  EXPECT_EQ(placeOf(attempts.best()), 0.0);
  EXPECT_EQ(attempts.rival().similarity, -1.0);
  attempts.addRival(attempt(10.0, 0.5));
  EXPECT_EQ(attempts.rival().similarity, 0.5);
}

}  // namespace
}  // namespace xray_registration

#include "xray_registration/evaluation/body_statistics.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

Trial trialOf(const std::string& name, double mtre_mm, double inplane_mm, bool accepted) {
  BodyTrial body;
  body.result.name = name;
  body.result.solved = true;
  body.result.accepted = accepted;
  body.final = {mtre_mm, inplane_mm};
  Trial trial;
  trial.bodies.push_back(body);
  return trial;
}

TEST(BodyStatistics, CountsEachBodyByItself) {
  const std::vector<Trial> trials = {trialOf("T10", 0.2, 0.1, true), trialOf("T10", 0.4, 0.1, false),
                                     trialOf("T11", 30.0, 29.0, true), trialOf("T10", 2.5, 0.3, true)};
  const std::vector<BodyStatistics> two_views = bodyStatisticsOf(trials, 2);
  ASSERT_EQ(two_views.size(), 2U);
  EXPECT_EQ(two_views[0].name, "T10");
  EXPECT_EQ(two_views[0].trials, 3);
  EXPECT_EQ(two_views[0].successes, 2);
  EXPECT_EQ(two_views[0].accepted, 2);
  EXPECT_EQ(two_views[0].false_acceptances, 1);
  EXPECT_EQ(two_views[0].false_refusals, 1);
  EXPECT_EQ(two_views[0].mtre_mm.median, 0.4);
  EXPECT_EQ(two_views[1].false_acceptances, 1);
  // One view hardly sees depth: what counts is in-plane.
  const std::vector<BodyStatistics> one_view = bodyStatisticsOf(trials, 1);
  EXPECT_EQ(one_view[0].successes, 3);
  EXPECT_EQ(one_view[0].false_acceptances, 0);
  EXPECT_EQ(one_view[1].false_acceptances, 1);
}

}  // namespace
}  // namespace xray_registration

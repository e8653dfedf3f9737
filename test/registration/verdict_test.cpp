#include "xray_registration/registration/verdict.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace xray_registration {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Passes every cue.
VerdictCues good() {
  VerdictCues cues;
  cues.converged = true;
  cues.similarity = 0.9;
  cues.inlier_fraction = 0.9;
  cues.condition_number = 1000.0;
  cues.jump_mm = 3.0;
  cues.jump_rad = 0.05;
  cues.disagreement_mm = 0.1;
  return cues;
}

/// Thresholds unlike any default, so that a sentence can only have them from here.
AcceptOptions thresholds() {
  AcceptOptions accept;
  accept.min_similarity = 0.31;
  accept.min_inlier_fraction = 0.23;
  accept.alone_similarity = 0.61;
  accept.alone_inlier_fraction = 0.43;
  accept.max_condition_number = 7000.0;
  accept.max_jump_mm = 17.0;
  accept.max_jump_rad = 0.2;
  accept.max_disagreement_mm = 1.7;
  accept.min_margin = 0.04;
  accept.clear_margin = 0.11;
  return accept;
}

struct Case {
  const char* name;
  std::function<void(VerdictCues*)> spoil;
  std::vector<std::string> said;  ///< Parts of the sentence: what, the number, the threshold.
};

/// In the order in which the verdict names them.
std::vector<Case> cases() {
  return {
      {"finite", [](VerdictCues* c) { c->finite = false; }, {"not finite"}},
      {"in view", [](VerdictCues* c) { c->in_view = false; }, {"left the image"}},
      {"steps", [](VerdictCues* c) { c->exceeded_steps = 17; }, {"ran out", "17", "solver/max_steps_per_frame"}},
      {"similarity", [](VerdictCues* c) { c->similarity = 0.27; }, {"similarity", "0.27", "0.61"}},
      {"inliers", [](VerdictCues* c) { c->inlier_fraction = 0.21; }, {"inlier fraction", "0.21", "0.43"}},
      {"condition", [](VerdictCues* c) { c->condition_number = 8000.0; }, {"condition number", "8e+03", "7e+03"}},
      {"converged", [](VerdictCues* c) { c->converged = false; }, {"converged"}},
      {"range",
       [](VerdictCues* c) {
         c->search_range_mm = 66.0;
         c->jump_mm = 81.0;
       },
       {"from the start", "81", "66"}},
      {"turned range",
       [](VerdictCues* c) {
         c->search_range_rad = 0.4;
         c->jump_rad = 0.5;
       },
       {"degrees from the start", "28.6", "22.9"}},
      {"jump",
       [](VerdictCues* c) {
         c->tracking = true;
         c->jump_mm = 19.0;
       },
       {"jumped", "19", "17"}},
      {"turn",
       [](VerdictCues* c) {
         c->tracking = true;
         c->jump_rad = 0.25;
       },
       {"turned", "14.3", "11.5"}},
      {"rival",
       [](VerdictCues* c) {
         c->has_second_solve = true;
         c->rival_similarity = 0.88;
         c->rival_mm = 23.0;
       },
       {"another place", "23", "0.88", "0.9"}},
      {"second solve",
       [](VerdictCues* c) {
         c->has_second_solve = true;
         c->disagreement_mm = 2.6;
       },
       {"second solve", "2.6", "1.7"}},
  };
}

TEST(VerdictTest, GoodSolutionsPass) {
  EXPECT_EQ(reasonToRefuse(good(), thresholds()), "");
  VerdictCues tracked = good();
  tracked.tracking = true;
  tracked.has_second_solve = true;
  tracked.search_range_mm = 66.0;
  tracked.search_range_rad = 0.4;
  EXPECT_EQ(reasonToRefuse(tracked, thresholds()), "");
}

TEST(VerdictTest, NumbersAtTheirThresholdsPass) {
  const AcceptOptions accept = thresholds();
  VerdictCues cues = good();
  cues.tracking = true;
  cues.has_second_solve = true;
  cues.similarity = accept.min_similarity;
  cues.inlier_fraction = accept.min_inlier_fraction;
  cues.condition_number = accept.max_condition_number;
  cues.jump_mm = accept.max_jump_mm;
  cues.jump_rad = accept.max_jump_rad;
  cues.disagreement_mm = accept.max_disagreement_mm;
  EXPECT_EQ(reasonToRefuse(cues, accept), "");
}

TEST(VerdictTest, WhatStandsClearOfEveryOtherPlaceNeedsOnlyTheLeast) {
  const AcceptOptions accept = thresholds();
  VerdictCues cues = good();
  cues.similarity = 0.4;
  cues.inlier_fraction = 0.3;
  EXPECT_NE(reasonToRefuse(cues, accept), "");  // Alone.
  cues.has_second_solve = true;
  cues.rival_similarity = 0.2;
  EXPECT_EQ(reasonToRefuse(cues, accept), "");
  cues.disagreement_mm = 2.0;  // Far above the others, but not found twice.
  EXPECT_NE(reasonToRefuse(cues, accept).find("second solve"), std::string::npos);
  cues.disagreement_mm = 0.1;
  cues.rival_similarity = 0.37;
  EXPECT_NE(reasonToRefuse(cues, accept).find("another place"), std::string::npos);
  cues.rival_similarity = 0.2;
  cues.inlier_fraction = 0.22;
  EXPECT_NE(reasonToRefuse(cues, accept).find("0.23"), std::string::npos);
  cues.similarity = 0.3;
  EXPECT_NE(reasonToRefuse(cues, accept).find("0.31"), std::string::npos);
}

TEST(VerdictTest, OneViewNeedsMore) {
  AcceptOptions accept = thresholds();
  accept.min_similarity_one_view = 0.52;
  accept.min_inlier_fraction_one_view = 0.2;  // Never less than several need.
  accept.alone_similarity_one_view = 0.8;
  accept.alone_inlier_fraction_one_view = 0.9;
  const AcceptOptions two = thresholdsFor(2, accept);
  EXPECT_EQ(two.min_similarity, 0.31);
  EXPECT_EQ(two.alone_similarity, 0.61);
  const AcceptOptions one = thresholdsFor(1, accept);
  EXPECT_EQ(one.min_similarity, 0.52);
  EXPECT_EQ(one.min_inlier_fraction, 0.23);
  EXPECT_EQ(one.alone_similarity, 0.8);
  EXPECT_EQ(one.alone_inlier_fraction, 0.9);
}

TEST(VerdictTest, TheLeastHoldsForWhatStandsAloneToo) {
  AcceptOptions accept = thresholds();
  accept.min_similarity = 0.95;
  EXPECT_NE(reasonToRefuse(good(), accept).find("0.95"), std::string::npos);
  EXPECT_FALSE(standsAlone(0.94, 0.9, accept));
  EXPECT_TRUE(standsAlone(0.96, 0.9, accept));
  EXPECT_FALSE(standsAlone(0.96, 0.4, accept));
}

TEST(VerdictTest, ATrackedFrameMayBeLittleLessAlikeThanItsColdStart) {
  const AcceptOptions accept = thresholds();
  VerdictCues cues = good();
  cues.tracking = true;
  cues.similarity = 0.45;
  cues.inlier_fraction = 0.35;
  EXPECT_NE(reasonToRefuse(cues, accept), "");  // Its cold start was as alike as can be.
  cues.found_similarity = 0.5;
  EXPECT_NE(reasonToRefuse(cues, accept).find("inlier"), std::string::npos);
  cues.found_inlier_fraction = 0.4;
  EXPECT_EQ(reasonToRefuse(cues, accept), "");
  cues.similarity = 0.39;
  EXPECT_NE(reasonToRefuse(cues, accept).find("below 0.4"), std::string::npos);
}

TEST(VerdictTest, EachCueAloneRefusesAndSaysWhy) {
  for (const Case& c : cases()) {
    VerdictCues cues = good();
    c.spoil(&cues);
    const std::string reason = reasonToRefuse(cues, thresholds());
    EXPECT_FALSE(reason.empty()) << c.name;
    for (const std::string& part : c.said) {
      EXPECT_NE(reason.find(part), std::string::npos) << c.name << " lacks '" << part << "': " << reason;
    }
  }
}

TEST(VerdictTest, TheMoreBasicCueIsNamedFirst) {
  const std::vector<Case> all = cases();
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      VerdictCues cues = good();
      // The more basic one last: where two set the same number, its value holds.
      all[j].spoil(&cues);
      all[i].spoil(&cues);
      const std::string reason = reasonToRefuse(cues, thresholds());
      EXPECT_NE(reason.find(all[i].said.front()), std::string::npos)
          << all[i].name << " before " << all[j].name << ": " << reason;
    }
  }
}

TEST(VerdictTest, CuesThatDoNotApplyAreNotJudged) {
  VerdictCues cold = good();
  cold.jump_mm = 50.0;
  cold.jump_rad = 1.0;
  EXPECT_EQ(reasonToRefuse(cold, thresholds()), "");
  cold.disagreement_mm = 50.0;
  EXPECT_EQ(reasonToRefuse(cold, thresholds()), "");
}

TEST(VerdictTest, WhatStandsFarAboveAllElseNeedNotBeFoundTwice) {
  VerdictCues cues = good();
  cues.has_second_solve = true;
  cues.disagreement_mm = 25.0;
  cues.rival_similarity = cues.similarity - 0.1;
  EXPECT_NE(reasonToRefuse(cues, thresholds()).find("second solve"), std::string::npos);
  cues.rival_similarity = cues.similarity - 0.12;
  EXPECT_EQ(reasonToRefuse(cues, thresholds()), "");
  cues.rival_similarity = -1.0;  // Nothing else was found: nothing to stand above.
  EXPECT_NE(reasonToRefuse(cues, thresholds()).find("second solve"), std::string::npos);
}

TEST(VerdictTest, WhatIsNotANumberNeverPasses) {
  const std::vector<std::function<void(VerdictCues*)>> spoilers = {
      [](VerdictCues* c) { c->similarity = kNan; },
      [](VerdictCues* c) { c->inlier_fraction = kNan; },
      [](VerdictCues* c) { c->condition_number = kNan; },
      [](VerdictCues* c) { c->tracking = true, c->jump_mm = kNan; },
      [](VerdictCues* c) { c->tracking = true, c->jump_rad = kNan; },
      [](VerdictCues* c) { c->search_range_mm = 60.0, c->jump_mm = kNan; },
      [](VerdictCues* c) { c->search_range_rad = 0.4, c->jump_rad = kNan; },
      [](VerdictCues* c) { c->has_second_solve = true, c->disagreement_mm = kNan; },
      [](VerdictCues* c) { c->has_second_solve = true, c->rival_similarity = kNan; },
  };
  for (std::size_t i = 0; i < spoilers.size(); ++i) {
    VerdictCues cues = good();
    spoilers[i](&cues);
    EXPECT_NE(reasonToRefuse(cues, thresholds()), "") << "cue " << i;
  }
}

}  // namespace
}  // namespace xray_registration

#include "registration/setup_check.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "registration/setup_trials.h"

namespace xray_registration {
namespace {

/// σ from zero at which an estimate is certain. On right inputs the sessions' largest was 5 (the wrist): windows
/// are not quite independent, and what a CT is not exact in is no noise.
constexpr double kCertain = 6.0;
/// A step from a compromise sees a part of the whole effect: so much of what matters is enough to try.
constexpr double kPartSeen = 0.25;
/// Tiles of a view that the check looks at, at most: it takes the finest level with no more.
constexpr int kMostTiles = 1600;
constexpr double kDegreesPerRadian = 57.29577951308232;

int finestLevel(const DeviceViews& views) {
  int level = 0;
  for (const DeviceViews::View& view : views.views()) {
    while (level < views.lastLevel() && view.level(level).tiles() > kMostTiles) ++level;
  }
  return level;
}

void addSuspicions(const SetupHypothesis& hypothesis, const ScoreTest& test, std::vector<SetupSuspicion>* suspicions) {
  for (const SetupQuantity& quantity : hypothesis.quantities) {
    // What was told is off by the opposite of the correction.
    const Amount amount = amountOf(quantity, -test.estimate, test.covariance);
    suspicions->push_back({hypothesis.what, hypothesis.in_words + (quantity.of.empty() ? "" : " (" + quantity.of + ")"),
                           amount.value, amount.sigma, quantity.unit, test.effect_mm, test.deviations > kCertain});
  }
}

}  // namespace

void SetupCheck::forget() {
  hypotheses_.clear();
  scores_.clear();
  follows_.resize(6, 0);
}

void SetupCheck::addUp(const SetupEvidence& seen) {
  const Eigen::LDLT<Matrix6d> pose(Matrix6d(seen.matrix.topLeftCorner<6, 6>()));
  if (pose.info() == Eigen::Success && pose.vectorD().minCoeff() > 0.0) {
    follows_ = pose.solve(seen.matrix.topRows<6>());
  }
  for (std::size_t i = 0; i < hypotheses_.size(); ++i) scores_[i].add(scoreOf(seen, hypotheses_[i].basis));
}

SetupOpinion SetupCheck::look(SetupObjective* objective, const Solution& solution,
                              const std::vector<std::string>& view_names, double limit_mm) {
  const Setup told = toldSetup(objective->views(), solution.T_camera_ct);
  if (hypotheses_.empty() || view_names != view_names_) {
    view_names_ = view_names;
    hypotheses_ = setupHypotheses(SetupLayout(told.views.size()), view_names);
    scores_.assign(hypotheses_.size(), Score());
  }
  const int level = finestLevel(objective->views());
  const std::optional<SetupEvidence> seen = objective->evaluate(told, {level, 1, 1}, solution.robust_scale2);
  SetupOpinion opinion;
  if (!seen) return opinion;
  addUp(*seen);
  std::vector<ScoreTest> tests;
  bool doubtful = false;
  for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
    const ScoreTest test = conclude(scores_[i]);
    tests.push_back(test);
    if (!test.determined) continue;
    addSuspicions(hypotheses_[i], test, &opinion.suspicions);
    doubtful |= test.deviations > kCertain && test.effect_mm > kPartSeen * limit_mm;
  }
  if (doubtful) opinion.refusal = tryHypotheses(objective, solution, level, hypotheses_, tests, limit_mm);
  return opinion;
}

Matrix6d SetupCheck::consideredCovariance(const SetupSigmas& sigmas) const {
  if (follows_.cols() == 0) return Matrix6d::Zero();
  const SetupLayout layout(view_names_.size());
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(layout.size());
  for (std::size_t view = 0; view < layout.views(); ++view) {
    sigma[layout.of(view, SetupLayout::kFocal)] = sigmas.focal_length;
    sigma.segment<2>(layout.of(view, SetupLayout::kCentre)).setConstant(sigmas.principal_point_px);
    if (view == 0) continue;
    sigma.segment<3>(layout.of(view, SetupLayout::kViewPose)).setConstant(sigmas.view_translation_mm);
    sigma.segment<3>(layout.of(view, SetupLayout::kViewPose) + 3)
        .setConstant(sigmas.view_rotation_deg / kDegreesPerRadian);
  }
  const Eigen::MatrixXd parts = follows_ * sigma.asDiagonal();
  // A CT is too large or too small as a whole: one parameter.
  const Twist by_scale = sigmas.ct_scale * follows_.middleCols<3>(SetupLayout::kStrain).rowwise().sum();
  return parts * parts.transpose() + by_scale * by_scale.transpose();
}

}  // namespace xray_registration

#include "registration/setup_check.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "registration/residual_field.h"
#include "registration/setup_trials.h"
#include "xray_registration/geometry/angles.h"

namespace xray_registration {
namespace {

/// σ from zero at which an estimate is certain. On right inputs the sessions' largest was 5 (the wrist): windows
/// are not quite independent, and what a CT is not exact in is no noise.
constexpr double kCertain = 6.0;
/// A step from a compromise sees a part of the whole effect: so much of what matters is enough to try.
constexpr double kPartSeen = 0.25;
/// Tiles of a view that the check looks at, at most: it takes the finest level with no more.
constexpr int kMostTiles = 1600;
/// Share of the evidence for a field of motions that a distortion has to explain to be named.
constexpr double kMostlyExplained = 0.7;
/// Of the evidence, at each look: ten looks count.
constexpr double kRemembered = 0.9;

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

const ScoreTest& stronger(const ScoreTest& a, const ScoreTest& b) {
  if (!a.determined || !b.determined) return a.determined ? a : b;
  return a.deviations > b.deviations ? a : b;
}

bool isDoubtful(const ScoreTest& test, const AcceptOptions& accept) {
  return test.determined && test.deviations > kCertain && test.effect_mm > kPartSeen * accept.max_setup_error_mm;
}

bool tooMuch(const ResidualField& left, const AcceptOptions& accept) {
  return left.determined && left.deviations > kCertain && left.rms_mm > accept.max_residual_motion_mm;
}

SetupSuspicion suspicionOf(const ResidualField& left) {
  return {"other_patient",
          "the shape of the CT (what no pose moves away)",
          left.rms_mm,
          left.sigma_mm,
          "mm",
          left.rms_mm,
          left.deviations > kCertain};
}

/// A distortion that was not told cannot be tried. Its score is what speaks for it.
bool isCertainDistortion(const SetupHypothesis& hypothesis, const ScoreTest& test) {
  return !hypothesis.can_be_tried && test.determined && test.deviations > kCertain;
}

std::string distortionInWords(const SetupHypothesis& hypothesis, const ScoreTest& test) {
  const SetupQuantity& quantity = hypothesis.quantities.front();
  std::ostringstream text;
  text << hypothesis.in_words << " looks "
       << inWords(amountOf(quantity, -test.estimate, test.covariance), quantity.unit) << " off, which moves the CT by "
       << std::setprecision(2) << test.effect_mm << " mm: " << hypothesis.remedy;
  return text.str();
}

/// The certain distortion that has the most merit, at least `least`; else empty.
std::string bestDistortion(const std::vector<SetupHypothesis>& hypotheses, const std::vector<ScoreTest>& tests,
                           const std::vector<double>& merits, double least) {
  std::string words;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    if (!isCertainDistortion(hypotheses[i], tests[i]) || merits[i] < least) continue;
    least = merits[i];
    words = distortionInWords(hypotheses[i], tests[i]);
  }
  return words;
}

std::string misfitInWords(const ResidualField& left, const AcceptOptions& accept) {
  std::ostringstream text;
  text << std::setprecision(2) << "the CT and the X-rays differ in shape: where the pose is best, parts are still "
       << left.rms_mm << " ± " << left.sigma_mm << " mm from where the CT has them, more than "
       << accept.max_residual_motion_mm
       << ": is the CT another patient's, or bent, or is more than one thing told wrongly?";
  return text.str();
}

}  // namespace

void SetupCheck::forget() {
  hypotheses_.clear();
  scores_.clear();
  follows_.resize(6, 0);
}

void SetupCheck::expect(const Setup& told, const std::vector<std::string>& view_names) {
  if (!hypotheses_.empty() && view_names == view_names_) return;
  view_names_ = view_names;
  hypotheses_ = setupHypotheses(SetupLayout(told.views.size()), view_names);
  scores_.assign(hypotheses_.size(), Score());
}

void SetupCheck::addUp(const SetupEvidence& seen) {
  const Eigen::LDLT<Matrix6d> pose(Matrix6d(seen.matrix.topLeftCorner<6, 6>()));
  if (pose.info() == Eigen::Success && pose.vectorD().minCoeff() > 0.0) {
    follows_ = pose.solve(seen.matrix.topRows<6>());
  }
  own_.clear();
  for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
    own_.push_back(scoreOf(seen, hypotheses_[i].basis));
    scores_[i].fade(kRemembered);
    scores_[i].add(own_.back());
  }
}

SetupOpinion SetupCheck::look(SetupObjective* objective, const Solution& solution,
                              const std::vector<std::string>& view_names, const AcceptOptions& accept) {
  const Setup told = toldSetup(objective->views(), solution.T_camera_ct);
  const int level = finestLevel(objective->views());
  const std::optional<SetupEvidence> seen = objective->evaluate(told, {level, 1, 1}, solution.robust_scale2);
  SetupOpinion opinion;
  if (!seen) return opinion;
  expect(told, view_names);
  addUp(*seen);
  std::vector<ScoreTest> tests;
  std::vector<double> explained;  // By each hypothesis, of this frame.
  std::vector<double> certainty;  // Of those that move the pose by what matters.
  bool doubtful = false;
  for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
    const ScoreTest all = conclude(scores_[i]);
    if (all.determined) addSuspicions(hypotheses_[i], all, &opinion.suspicions);
    const ScoreTest own = conclude(own_[i]);
    tests.push_back(stronger(all, own));
    const bool matters = tests.back().effect_mm >= accept.max_setup_error_mm;
    explained.push_back(own.gain);
    certainty.push_back(matters ? tests.back().deviations : 0.0);
    doubtful |= isDoubtful(tests.back(), accept);
  }
  const ResidualField left = residualField(*seen);
  if (left.determined) opinion.suspicions.push_back(suspicionOf(left));
  if (!doubtful && !tooMuch(left, accept)) return opinion;
  // What leaves parts of the X-rays elsewhere is a cause also where the pose hardly follows it.
  const double least_mm = tooMuch(left, accept) ? 0.0 : accept.max_setup_error_mm;
  const auto cause = tryHypotheses(objective, solution, level, hypotheses_, tests, least_mm);
  if (cause && !tooMuch(cause->left, accept)) {
    opinion.refusal = cause->in_words;
    return opinion;
  }
  if (tooMuch(left, accept)) {
    opinion.refusal = bestDistortion(hypotheses_, tests, explained, kMostlyExplained * left.gain);
    if (opinion.refusal.empty()) opinion.refusal = misfitInWords(left, accept);
  }
  if (cause) {
    opinion.refusal += (opinion.refusal.empty() ? "" : "; the closest single cause: ") + cause->in_words;
  } else if (opinion.refusal.empty()) {
    opinion.refusal = bestDistortion(hypotheses_, tests, certainty, kCertain);
  }
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

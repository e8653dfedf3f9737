#include "registration/setup_trials.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <optional>
#include <sstream>

#include "registration/setup_solver.h"

namespace xray_registration {
namespace {

/// σ of its score test from zero from which a hypothesis is worth a trial.
constexpr double kWorthTrying = 3.0;
/// σ of the paired windows by which another set-up has to explain the X-rays better, and another hypothesis than the
/// best one worse, to be told apart.
constexpr double kBetter = 5.0;
constexpr double kToldApart = 3.0;
/// Share of the best explanation's gain that is as good: what is left is the CT's own errors, and the least complex
/// that gains so much is the cause. Six of a view's pose imitate nearly anything.
constexpr double kAsGood = 0.95;
constexpr int kCoarseSteps = 8;
constexpr int kFineSteps = 4;

struct Trial {
  const SetupHypothesis* hypothesis = nullptr;
  SetupSolution found;
  double better_by = 0.0;  ///< σ of the windows' costs against the set-up as told.
  double gain = 0.0;       ///< Of cost, less what so many parameters gain by chance.
  double moved_mm = 0.0;   ///< The pose, by what was told wrongly.
};

/// σ by which one set-up explains the windows better than another: their costs are compared in pairs.
double betterBy(const SetupEvidence& one, const SetupEvidence& other) {
  double sum = 0.0;
  double sum2 = 0.0;
  for (std::size_t i = 0; i < std::min(one.windows.size(), other.windows.size()); ++i) {
    const double gain = other.windows[i].cost - one.windows[i].cost;
    sum += gain;
    sum2 += gain * gain;
  }
  return sum2 > 0.0 ? sum / std::sqrt(sum2) : 0.0;
}

/// What free parameters gain by fitting noise is ½ tr(S⁻¹ B) on average; three times that is no accident.
double chanceOf(const Score& score) {
  if (score.empty()) return 0.0;
  return 1.5 * std::max(Eigen::LDLT<Eigen::MatrixXd>(score.curvature).solve(score.scatter).trace(), 0.0);
}

std::optional<Trial> tryOne(SetupObjective* objective, const Solution& solution, int level,
                            const SetupHypothesis& hypothesis, const SetupSolution& plain) {
  const Stage coarse{std::min(level + 1, objective->views().lastLevel()), 2, kCoarseSteps};
  const Stage fine{level, 1, kFineSteps};
  const auto near = solveSetup(objective, coarse, solution.robust_scale2, hypothesis.basis, plain.setup);
  if (!near) return std::nullopt;
  auto found = solveSetup(objective, fine, solution.robust_scale2, hypothesis.basis, near->setup);
  if (!found) return std::nullopt;
  Trial trial;
  trial.hypothesis = &hypothesis;
  trial.better_by = betterBy(found->evidence, plain.evidence);
  const Eigen::Vector3d centre = plain.setup.T_camera_ct * objective->centreCt();
  trial.moved_mm = motionMm(twistBetween(plain.setup.T_camera_ct, found->setup.T_camera_ct, centre));
  trial.gain = plain.evidence.cost - found->evidence.cost - chanceOf(scoreOf(found->evidence, hypothesis.basis));
  trial.found = std::move(*found);
  return trial;
}

/// "1.02 ± 0.03 degrees and 2 ± 0.1 mm"
std::string amountOf(const Trial& trial, const Setup& told, const Eigen::Vector3d& centre_ct_mm) {
  const SetupHypothesis& hypothesis = *trial.hypothesis;
  const Eigen::VectorXd off =
      hypothesis.basis.completeOrthogonalDecomposition().solve(setupDifference(trial.found.setup, told, centre_ct_mm));
  const ScoreTest test = conclude(scoreOf(trial.found.evidence, hypothesis.basis));
  std::ostringstream text;
  for (const SetupQuantity& quantity : hypothesis.quantities) {
    const Amount amount = amountOf(quantity, off, test.covariance);
    text << (text.tellp() > 0 ? " and " : "") << inWords(amount, quantity.unit);
    if (hypothesis.quantities.size() > 1 && quantity.count == 1) text << " along " << quantity.of;
  }
  return text.str();
}

/// The cause first: of those that explain as good as everything the one that is least complex, then the best.
void putCauseFirst(std::vector<Trial>* trials) {
  double most = 0.0;
  for (const Trial& trial : *trials) most = std::max(most, trial.gain);
  std::sort(trials->begin(), trials->end(), [most](const Trial& a, const Trial& b) {
    const bool a_good = a.gain >= kAsGood * most;
    const bool b_good = b.gain >= kAsGood * most;
    if (a_good != b_good) return a_good;
    const int a_complexity = a.hypothesis->complexity;
    const int b_complexity = b.hypothesis->complexity;
    if (a_good && a_complexity != b_complexity) return a_complexity < b_complexity;
    return a.gain > b.gain;
  });
}

std::string inWords(const std::vector<Trial>& trials, const Setup& told, const Eigen::Vector3d& centre_ct_mm) {
  const Trial& best = trials.front();
  std::ostringstream text;
  text << best.hypothesis->in_words << " looks " << amountOf(best, told, centre_ct_mm) << " off, which moves the CT by "
       << std::setprecision(2) << best.moved_mm << " mm: " << best.hypothesis->remedy;
  for (const Trial& other : trials) {
    if (other.hypothesis->what == best.hypothesis->what) continue;
    if (betterBy(best.found.evidence, other.found.evidence) > kToldApart) continue;
    text << "; or " << other.hypothesis->in_words << " is wrong, which these views cannot tell apart";
    break;
  }
  return text.str();
}

}  // namespace

std::optional<SetupCause> tryHypotheses(SetupObjective* objective, const Solution& solution, int level,
                                        const std::vector<SetupHypothesis>& hypotheses,
                                        const std::vector<ScoreTest>& tests, double limit_mm) {
  const Setup told = toldSetup(objective->views(), solution.T_camera_ct);
  const Eigen::MatrixXd nothing_else(SetupLayout(told.views.size()).size(), 0);
  const auto plain = solveSetup(objective, {level, 1, kFineSteps}, solution.robust_scale2, nothing_else, told);
  if (!plain) return std::nullopt;
  std::vector<Trial> trials;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    if (!hypotheses[i].can_be_tried || !tests[i].determined || tests[i].deviations < kWorthTrying) continue;
    std::optional<Trial> trial = tryOne(objective, solution, level, hypotheses[i], *plain);
    if (trial) trials.push_back(std::move(*trial));
  }
  putCauseFirst(&trials);
  if (trials.empty() || trials.front().better_by < kBetter || trials.front().moved_mm < limit_mm) return std::nullopt;
  const SetupSolution& found = trials.front().found;
  return SetupCause{inWords(trials, plain->setup, objective->centreCt()), residualField(found.evidence)};
}

}  // namespace xray_registration

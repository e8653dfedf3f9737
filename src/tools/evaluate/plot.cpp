#include "tools/evaluate/plot.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tools/evaluate/panel.h"
#include "xray_registration/evaluation/operating_curve.h"

namespace xray_registration::tools {
namespace {

constexpr int kPanelWidth = 720;
constexpr int kPanelHeight = 460;

// BGR.
cv::Scalar good() { return {90, 150, 40}; }
cv::Scalar refused() { return {190, 140, 60}; }
cv::Scalar bad() { return {50, 50, 200}; }
cv::Scalar neutral() { return {120, 120, 120}; }

cv::Rect area(int column, int row) { return {column * kPanelWidth, row * kPanelHeight, kPanelWidth, kPanelHeight}; }

double decadeAbove(double value) { return std::pow(10.0, std::ceil(std::log10(std::max(value, 1.0)))); }

void drawErrors(cv::Mat* picture, const std::vector<Trial>& trials, const SuccessCriteria& criteria) {
  double largest_mm = 1.0;
  for (const Trial& trial : trials) {
    largest_mm = std::max(largest_mm, trial.start.mtre_mm);
    if (std::isfinite(trial.final.mtre_mm)) largest_mm = std::max(largest_mm, trial.final.mtre_mm);
  }
  const double end_mm = std::min(decadeAbove(largest_mm), 1.0e4);
  Panel panel(picture, area(0, 0), "Final error against start error", {"start mTRE, mm", 0.1, end_mm, true},
              {"final mTRE, mm", 0.01, end_mm, true});
  panel.line(0.1, criteria.max_mtre_mm, end_mm, criteria.max_mtre_mm, neutral());
  panel.line(0.1, 0.1, end_mm, end_mm, neutral());
  for (const Trial& trial : trials) {
    const bool success = criteria.isSuccess(trial.final);
    const cv::Scalar colour = !success ? bad() : trial.result.accepted ? good() : refused();
    panel.dot(trial.start.mtre_mm, trial.final.mtre_mm, colour);
    // A wrong result that was accepted is the dangerous one: make it stand out.
    if (criteria.isFalseAcceptance(trial)) panel.dot(trial.start.mtre_mm, trial.final.mtre_mm, {0, 0, 0}, 6);
  }
  panel.legend("success, accepted", good());
  panel.legend("success, refused", refused());
  panel.legend("no success", bad());
  panel.legend("false acceptance", {0, 0, 0});
}

void drawSuccess(cv::Mat* picture, const TrialStatistics& statistics) {
  const double end_mm = statistics.bins.empty() ? 2.0 : statistics.bins.back().to_mm;
  Panel panel(picture, area(1, 0), "Success by start error (trials above)", {"start mTRE, mm", 0.0, end_mm, false},
              {"success, %", 0.0, 110.0, false});
  for (const StartBin& bin : statistics.bins) {
    if (bin.trials == 0) continue;
    const double percent = 100.0 * bin.successRate();
    panel.bar(bin.from_mm, bin.to_mm, percent, percent >= 95.0 ? good() : bad());
    panel.text((bin.from_mm + bin.to_mm) / 2.0, percent, std::to_string(bin.trials), neutral());
  }
  panel.line(0.0, 95.0, end_mm, 95.0, neutral());
}

void drawConvergence(cv::Mat* picture, const std::vector<ConvergenceCurve>& curves) {
  int last_step = 10;
  double largest_mm = 1.0;
  for (const ConvergenceCurve& curve : curves) {
    if (!curve.steps.empty()) last_step = std::max(last_step, curve.steps.back());
    for (const double mtre_mm : curve.mtre_mm) {
      if (std::isfinite(mtre_mm)) largest_mm = std::max(largest_mm, mtre_mm);
    }
  }
  Panel panel(picture, area(0, 1), "Convergence of a few trials",
              {"steps allowed after the search", 0.0, static_cast<double>(last_step), false},
              {"mTRE, mm", 0.01, decadeAbove(largest_mm), true});
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const ConvergenceCurve& curve = curves[c];
    const double shade = 40.0 + 160.0 * static_cast<double>(c) / static_cast<double>(curves.size());
    const cv::Scalar colour(200.0 - shade / 2.0, shade, 60.0);
    for (std::size_t i = 0; i < curve.steps.size(); ++i) {
      panel.dot(curve.steps[i], curve.mtre_mm[i], colour, 2);
      if (i > 0) panel.line(curve.steps[i - 1], curve.mtre_mm[i - 1], curve.steps[i], curve.mtre_mm[i], colour);
    }
  }
  if (curves.empty()) panel.legend("not recorded", neutral());
}

void drawCurve(Panel* panel, const std::vector<OperatingPoint>& curve, const cv::Scalar& colour) {
  for (std::size_t i = 1; i < curve.size(); ++i) {
    panel->line(100.0 * curve[i - 1].false_acceptance, 100.0 * curve[i - 1].true_acceptance,
                100.0 * curve[i].false_acceptance, 100.0 * curve[i].true_acceptance, colour, 2);
  }
}

void drawVerdict(cv::Mat* picture, const std::vector<Trial>& trials, const SuccessCriteria& criteria) {
  Panel panel(picture, area(1, 1), "Verdict: good against wrong results accepted",
              {"wrong results accepted, %", 0.0, 100.0, false}, {"good results accepted, %", 0.0, 105.0, false});
  const auto by_similarity = operatingCurve(trials, criteria, [](const Trial& t) { return t.result.similarity; });
  if (by_similarity.empty()) {
    panel.legend("no wrong result to tell from the good ones (or no good one)", neutral());
    return;
  }
  drawCurve(&panel, by_similarity, good());
  drawCurve(&panel, operatingCurve(trials, criteria, [](const Trial& t) { return t.result.inlier_fraction; }),
            refused());
  drawCurve(&panel, operatingCurve(trials, criteria, [](const Trial& t) { return -t.result.condition_number; }),
            neutral());
  const auto verdict = operatingCurve(trials, criteria, [](const Trial& t) { return t.result.accepted ? 1.0 : 0.0; });
  for (const OperatingPoint& point : verdict) {
    if (point.threshold == 1.0) panel.dot(100.0 * point.false_acceptance, 100.0 * point.true_acceptance, bad(), 6);
  }
  panel.legend("similarity alone", good(), true);
  panel.legend("inlier fraction alone", refused(), true);
  panel.legend("condition number alone", neutral(), true);
  panel.legend("the verdict", bad(), true);
}

}  // namespace

cv::Mat drawPlot(const std::vector<Trial>& trials, const SuccessCriteria& criteria,
                 const std::vector<ConvergenceCurve>& convergence) {
  cv::Mat picture(2 * kPanelHeight, 2 * kPanelWidth, CV_8UC3, cv::Scalar(255, 255, 255));
  drawErrors(&picture, trials, criteria);
  drawSuccess(&picture, statisticsOf(trials, criteria));
  drawConvergence(&picture, convergence);
  drawVerdict(&picture, trials, criteria);
  return picture;
}

}  // namespace xray_registration::tools

#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "xray_registration/evaluation/trial_statistics.h"

namespace xray_registration::tools {

/// How one trial came closer: error after so many steps.
struct ConvergenceCurve {
  std::vector<int> steps;
  std::vector<double> mtre_mm;
};

/// Start error against final error, success by start error, convergence of a few trials, and the operating curve of
/// the verdict. 8-bit BGR.
cv::Mat drawPlot(const std::vector<Trial>& trials, const SuccessCriteria& criteria,
                 const std::vector<ConvergenceCurve>& convergence);

}  // namespace xray_registration::tools

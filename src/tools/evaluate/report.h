#pragma once

#include <cstdint>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/evaluate/convergence.h"
#include "xray_registration/evaluation/trial_statistics.h"
#include "xray_registration/evaluation/trials.h"
#include "xray_registration/evaluation/wrong_input.h"

namespace xray_registration::tools {

/// What was run, for the head of a report.
struct EvaluationRun {
  std::string session;  ///< The bag's name without folder and ending.
  std::string ct;
  std::vector<std::string> views;
  std::string method;
  std::string device;
  bool tracking = false;
  bool reference = false;  ///< The truth is a reference with an error of its own.
  TrialOptions options;
  std::vector<WrongInput> wrong;  ///< What the registration was told wrongly.
  int frames = 0;                 ///< With a true pose.
  double ct_upload_ms = 0.0;
  PoseError reference_agreement;  ///< Solution started at the reference against the reference; with `reference`.
};

/// {"trials": […], "summary": {…}, "wrong": […], "convergence": […] unless empty}; lengths in mm, angles in degrees,
/// times in ms. Of what was told wrongly stand its "text" and "what", the suspicion that would be right. A trial is a
/// "success", "wrong" (too far off to be accepted), or neither; its "cause" is the reason without numbers.
nlohmann::json toJson(const EvaluationRun& run, const std::vector<Trial>& trials, const SuccessCriteria& criteria,
                      const std::vector<ConvergenceCurve>& convergence);

/// A table for people.
void printTable(std::ostream& out, const EvaluationRun& run, const std::vector<Trial>& trials,
                const SuccessCriteria& criteria);

}  // namespace xray_registration::tools

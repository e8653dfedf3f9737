#include "tools/evaluate/report.h"

#include <cmath>
#include <iomanip>
#include <map>
#include <ostream>
#include <regex>
#include <sstream>

#include "tools/common/json_files.h"
#include "xray_registration/evaluation/body_statistics.h"
#include "xray_registration/geometry/angles.h"

namespace xray_registration::tools {
namespace {

using nlohmann::json;
using tools::toJson;

/// A reason without its numbers and what stands behind a colon, so that equal causes are counted together.
std::string causeOf(const std::string& reason) {
  static const std::regex kNumber("[0-9]+([.][0-9]+)?");
  return std::regex_replace(reason.substr(0, reason.find(':')), kNumber, "…");
}

/// Row by row: mm and rad, translation and rotation about the CT's centre in the first camera's axes.
json covarianceOf(const RegistrationResult& result) {
  json numbers = json::array();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) numbers.push_back(result.covariance(row, column));
  }
  return numbers;
}

json toJson(const std::vector<BodyTrial>& bodies) {
  json made = json::object();
  for (const BodyTrial& body : bodies) {
    const Eigen::Vector3d& centre = body.result.centre_ct_mm;
    made[body.result.name] = {{"final_mtre", body.final.mtre_mm},
                              {"final_inplane", body.final.inplane_mm},
                              {"final_rotation_deg", body.final_rotation_rad * kDegreesPerRadian},
                              {"accepted", body.result.accepted},
                              {"reason", body.result.reason},
                              {"similarity", body.result.similarity},
                              {"inlier_fraction", body.result.inlier_fraction},
                              {"depth_sigma_mm", std::sqrt(std::max(body.result.covariance(2, 2), 0.0))},
                              {"centre_mm", {centre.x(), centre.y(), centre.z()}},
                              {"T_camera_ct", toJson(body.result.T_camera_body)}};
  }
  return made;
}

json toJson(const Trial& trial, const SuccessCriteria& criteria) {
  const RegistrationResult& result = trial.result;
  return {{"frame", trial.frame},
          {"stamp", trial.stamp_s},
          {"start_rotation_deg", trial.disturbance.tail<3>().norm() * kDegreesPerRadian},
          {"start_translation_mm", trial.disturbance.head<3>().norm()},
          {"start_mtre", trial.start.mtre_mm},
          {"start_inplane", trial.start.inplane_mm},
          {"final_mtre", trial.final.mtre_mm},
          {"final_inplane", trial.final.inplane_mm},
          {"success", criteria.isSuccess(trial.final)},
          {"wrong", criteria.isWrong(trial.final)},
          {"accepted", result.accepted},
          {"reason", result.reason},
          {"suspicions", toJson(result.suspicions)},
          {"bodies", toJson(trial.bodies)},
          {"frames_to_find", trial.frames_to_find},
          {"depth_sigma_mm", std::sqrt(std::max(result.covariance(2, 2), 0.0))},
          {"covariance", covarianceOf(result)},
          {"cause", causeOf(result.reason)},
          {"converged", result.converged},
          {"iterations", result.iterations},
          {"similarity", result.similarity},
          {"residual", result.residual},
          {"inlier_fraction", result.inlier_fraction},
          {"condition_number", result.condition_number},
          {"rival_similarity", result.compared ? json(result.rival_similarity) : json()},
          {"disagreement_mm", result.compared ? json(result.disagreement_mm) : json()},
          {"prepare_ms", trial.prepare_ms},
          {"upload_ms", result.upload_ms},
          {"solve_ms", trial.solve_ms},
          {"T_camera_ct", toJson(result.T_camera_ct)}};
}

std::map<std::string, int> causes(const std::vector<Trial>& trials) {
  std::map<std::string, int> counted;
  for (const Trial& trial : trials) {
    if (!trial.result.accepted) ++counted[causeOf(trial.result.reason)];
  }
  return counted;
}

/// Of bodies, the name left out.
std::map<std::string, int> bodyCauses(const std::vector<Trial>& trials) {
  std::map<std::string, int> counted;
  for (const Trial& trial : trials) {
    for (const BodyTrial& body : trial.bodies) {
      if (body.result.accepted) continue;
      std::string reason = body.result.reason;
      const std::size_t name = reason.find(body.result.name);
      if (name != std::string::npos) reason.replace(name, body.result.name.size(), "a body");
      ++counted[causeOf(reason)];
    }
  }
  return counted;
}

json bodiesSummary(const std::vector<Trial>& trials, std::size_t views) {
  json made = json::object();
  for (const BodyStatistics& body : bodyStatisticsOf(trials, views)) {
    made[body.name] = {{"trials", body.trials},
                       {"successes", body.successes},
                       {"accepted", body.accepted},
                       {"false_acceptances", body.false_acceptances},
                       {"false_refusals", body.false_refusals},
                       {"mtre", toJson(body.mtre_mm)},
                       {"inplane", toJson(body.inplane_mm)}};
  }
  return made;
}

json toJson(const SuccessCriteria& criteria) {
  return {{"max_mtre_mm", criteria.max_mtre_mm},
          {"max_inplane_mm", criteria.max_inplane_mm},
          {"gross_mtre_mm", criteria.gross_mtre_mm},
          {"false_acceptance_mtre_mm", criteria.false_acceptance_mtre_mm}};
}

json summary(const EvaluationRun& run, const std::vector<Trial>& trials, const SuccessCriteria& criteria) {
  const TrialStatistics statistics = statisticsOf(trials, criteria);
  json bins = json::array();
  for (const StartBin& bin : statistics.bins) {
    bins.push_back(
        {{"from_mm", bin.from_mm}, {"to_mm", bin.to_mm}, {"trials", bin.trials}, {"successes", bin.successes}});
  }
  json made = {{"session", run.session},
               {"ct", run.ct},
               {"views", run.views},
               {"method", run.method},
               {"device", run.device},
               {"tracking", run.tracking},
               {"reference", run.reference},
               {"frames", run.frames},
               {"seed", run.options.seed},
               {"rotation_deg", run.options.range.rotation_rad * kDegreesPerRadian},
               {"translation_mm", run.options.range.translation_mm},
               {"target_size_mm", run.options.target_size_mm},
               {"criteria", toJson(criteria)},
               {"trials", statistics.trials},
               {"success_rate", statistics.successRate()},
               {"gross_failure_rate", statistics.grossFailureRate()},
               {"accepted_rate", statistics.acceptedRate()},
               {"false_acceptances", statistics.false_acceptances},
               {"false_acceptance_rate", statistics.falseAcceptanceRate()},
               {"false_refusals", statistics.false_refusals},
               {"false_refusal_rate", statistics.falseRefusalRate()},
               {"median_start_mtre", statistics.start_mtre_mm.median},
               {"median_mtre", statistics.final_mtre_mm.median},
               {"p95_mtre", statistics.final_mtre_mm.p95},
               {"median_inplane", statistics.final_inplane_mm.median},
               {"p95_inplane", statistics.final_inplane_mm.p95},
               {"capture_range_mm", statistics.capture_range_mm},
               {"bins", bins},
               {"iterations", toJson(statistics.iterations)},
               {"prepare_ms", toJson(statistics.prepare_ms)},
               {"solve_ms", toJson(statistics.solve_ms)},
               {"frame_ms", toJson(statistics.frame_ms)},
               {"ct_upload_ms", run.ct_upload_ms},
               {"bodies", bodiesSummary(trials, run.views.size())},
               {"refused_because", causes(trials)}};
  if (run.reference) {
    made["reference_agreement_mtre"] = run.reference_agreement.mtre_mm;
    made["reference_agreement_inplane"] = run.reference_agreement.inplane_mm;
  }
  return made;
}

std::string percent(double rate, int part, int of) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << 100.0 * rate << " %  (" << part << " of " << of << ")";
  return text.str();
}

std::string number(double value, int digits) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << value;
  return text.str();
}

std::string three(const Percentiles& values, int digits, const std::string& unit) {
  return "median " + number(values.median, digits) + "   p95 " + number(values.p95, digits) + "   p99 " +
         number(values.p99, digits) + (unit.empty() ? "" : " " + unit);
}

void row(std::ostream& out, const std::string& name, const std::string& value) {
  out << "  " << std::left << std::setw(22) << name << value << '\n';
}

void printHead(std::ostream& out, const EvaluationRun& run) {
  out << run.session;
  for (const std::string& view : run.views) out << (view.empty() ? "" : " [" + view + "]");
  out << ", CT " << run.ct << ", method " << run.method << ", device " << run.device << '\n';
  if (run.tracking) {
    out << "tracked from the first frame's " << (run.reference ? "reference" : "true") << " pose";
  } else if (run.options.kind == TrialKind::kFromNothing) {
    out << run.options.trials << " wide searches without a start";
  } else {
    out << run.options.trials << (run.options.kind == TrialKind::kLost ? " losses of" : "")
        << (run.options.kind == TrialKind::kLocalize ? " wide searches around" : "") << " starts within "
        << run.options.range.rotation_rad * kDegreesPerRadian << " deg, " << run.options.range.translation_mm
        << " mm, seed " << run.options.seed;
  }
  out << "; " << run.frames << " frames with a " << (run.reference ? "reference" : "true") << " pose; targets "
      << run.options.target_size_mm << " mm\n";
  for (const WrongInput& wrong : run.wrong) out << "told wrongly: " << wrong.text << '\n';
}

void printFrames(std::ostream& out, const std::vector<Trial>& trials) {
  out << "  frame   predicted mm   mTRE mm   in-plane mm   similarity   steps   verdict\n";
  for (const Trial& trial : trials) {
    out << std::right << std::fixed << "  " << std::setw(5) << trial.frame << std::setprecision(2) << std::setw(15)
        << trial.start.mtre_mm << std::setprecision(3) << std::setw(10) << trial.final.mtre_mm << std::setw(14)
        << trial.final.inplane_mm << std::setw(13) << trial.result.similarity << std::setw(8) << trial.result.iterations
        << "   " << (trial.result.accepted ? "accepted" : trial.result.reason) << '\n';
  }
  out << std::defaultfloat << std::setprecision(6);
}

void printBins(std::ostream& out, const TrialStatistics& statistics) {
  out << "  success by start mTRE\n";
  for (const StartBin& bin : statistics.bins) {
    if (bin.trials == 0) continue;
    out << std::right << std::setw(6) << bin.from_mm << " - " << std::setw(3) << bin.to_mm << " mm  " << std::setw(4)
        << bin.successes << " of " << std::setw(4) << bin.trials << "  "
        << std::string(static_cast<std::size_t>(std::lround(40.0 * bin.successRate())), '#') << '\n';
  }
}

void printBodies(std::ostream& out, const std::vector<Trial>& trials, std::size_t views) {
  const std::vector<BodyStatistics> bodies = bodyStatisticsOf(trials, views);
  if (bodies.empty()) return;
  out << "  body         good   accepted   wrong accepted   good refused   median mTRE   in-plane   p95 mTRE   "
         "in-plane\n";
  for (const BodyStatistics& body : bodies) {
    const std::string of = "/" + std::to_string(body.trials);
    out << "  " << std::left << std::setw(10) << body.name << std::right << std::setw(7)
        << std::to_string(body.successes) + of << std::setw(11) << std::to_string(body.accepted) + of << std::setw(17)
        << body.false_acceptances << std::setw(15) << body.false_refusals << std::setw(14)
        << number(body.mtre_mm.median, 3) << std::setw(11) << number(body.inplane_mm.median, 3) << std::setw(11)
        << number(body.mtre_mm.p95, 3) << std::setw(11) << number(body.inplane_mm.p95, 3) << '\n';
  }
  for (const auto& [cause, count] : bodyCauses(trials)) out << "  refused " << count << " times: " << cause << '\n';
}

}  // namespace

json toJson(const EvaluationRun& run, const std::vector<Trial>& trials, const SuccessCriteria& criteria,
            const std::vector<ConvergenceCurve>& convergence) {
  json made = {{"trials", json::array()}, {"summary", summary(run, trials, criteria)}, {"wrong", json::array()}};
  for (const Trial& trial : trials) made["trials"].push_back(toJson(trial, criteria));
  for (const WrongInput& wrong : run.wrong) made["wrong"].push_back({{"text", wrong.text}, {"what", wrong.what}});
  for (const ConvergenceCurve& curve : convergence) {
    made["convergence"].push_back({{"steps", curve.steps}, {"mtre", curve.mtre_mm}});
  }
  return made;
}

void printTable(std::ostream& out, const EvaluationRun& run, const std::vector<Trial>& trials,
                const SuccessCriteria& criteria) {
  const TrialStatistics s = statisticsOf(trials, criteria);
  printHead(out, run);
  if (run.tracking) printFrames(out, trials);
  row(out, "success", percent(s.successRate(), s.successes, s.trials));
  row(out, "gross failure", percent(s.grossFailureRate(), s.gross_failures, s.trials));
  row(out, "accepted", percent(s.acceptedRate(), s.accepted, s.trials));
  row(out, "false acceptance", percent(s.falseAcceptanceRate(), s.false_acceptances, s.trials));
  row(out, "good ones refused", percent(s.falseRefusalRate(), s.false_refusals, s.successes));
  row(out, "start mTRE", three(s.start_mtre_mm, 2, "mm"));
  row(out, "final mTRE", three(s.final_mtre_mm, 3, "mm"));
  row(out, "final in-plane error", three(s.final_inplane_mm, 3, "mm"));
  row(out, "steps", three(s.iterations, 0, ""));
  row(out, "frame prepared in", three(s.prepare_ms, 1, "ms"));
  row(out, "registered in", three(s.solve_ms, 1, "ms"));
  row(out, "image to verdict", three(s.frame_ms, 1, "ms"));
  row(out, "CT uploaded in", number(run.ct_upload_ms, 0) + " ms (apart)");
  if (run.reference) {
    row(out, "from the reference",
        "mTRE " + number(run.reference_agreement.mtre_mm, 3) + "   in-plane " +
            number(run.reference_agreement.inplane_mm, 3) + " mm to the solution that starts there");
  }
  if (!run.tracking) {
    row(out, "capture range", number(s.capture_range_mm, 0) + " mm");
    printBins(out, s);
  }
  printBodies(out, trials, run.views.size());
  for (const auto& [cause, count] : causes(trials)) out << "  refused " << count << " times: " << cause << '\n';
}

}  // namespace xray_registration::tools

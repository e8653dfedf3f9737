#include "tools/register_bag/report.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <string>

#include "tools/common/json_files.h"
#include "xray_registration/common/statistics.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration::tools {
namespace {

using nlohmann::json;
using tools::toJson;

void addError(const PoseError& error, json* entry) {
  (*entry)["mtre"] = error.mtre_mm;
  (*entry)["inplane"] = error.inplane_mm;
}

json toJson(const BodyResult& body, const FrameRecord& record) {
  json entry = {
      {"T_camera_ct", nullptr}, {"accepted", body.accepted}, {"reason", body.reason}, {"similarity", body.similarity}};
  if (body.solved) {
    entry["T_camera_ct"] = toJson(body.T_camera_body);
    entry["covariance"] = toPoseWithCovariance(body.T_camera_body, body.covariance, body.centre_ct_mm).covariance;
  }
  const auto error = record.body_errors.find(body.name);
  if (error != record.body_errors.end()) addError(error->second, &entry);
  return entry;
}

json toJson(const FrameRecord& record, const Eigen::Vector3d& centre_ct_mm) {
  const RegistrationResult& result = record.outcome.result;
  json frame = {{"stamp", record.stamp.toSec()},   {"accepted", result.accepted},
                {"T_camera_ct", nullptr},          {"iterations", result.iterations},
                {"solve_ms", result.solve_ms},     {"total_ms", record.outcome.total_ms},
                {"similarity", result.similarity}, {"state", toString(record.outcome.state)},
                {"reason", result.reason},         {"suspicions", toJson(result.suspicions)}};
  if (record.outcome.registered) {
    frame["T_camera_ct"] = toJson(result.T_camera_ct);
    frame["covariance"] = toPoseWithCovariance(result.T_camera_ct, result.covariance, centre_ct_mm).covariance;
  }
  if (record.error) addError(*record.error, &frame);
  frame["bodies"] = json::object();
  for (const BodyResult& body : result.bodies) frame["bodies"][body.name] = toJson(body, record);
  return frame;
}

/// Of the CT or of a body, over the session.
struct Tally {
  std::size_t accepted = 0;
  std::string last_reason;
  std::vector<double> mtre_mm, inplane_mm;

  void add(bool is_accepted, const std::string& reason, const PoseError* error) {
    if (!is_accepted) {
      last_reason = reason;
      return;
    }
    ++accepted;
    if (error == nullptr) return;
    mtre_mm.push_back(error->mtre_mm);
    inplane_mm.push_back(error->inplane_mm);
  }
};

void printErrors(const Tally& tally) {
  if (tally.mtre_mm.empty()) return;
  std::printf("against the ground truth: mTRE median %.3f mm, worst %.3f mm; in-plane median %.3f mm, worst %.3f mm\n",
              median(tally.mtre_mm), largest(tally.mtre_mm), median(tally.inplane_mm), largest(tally.inplane_mm));
}

void printBody(const std::string& name, const Tally& tally, std::size_t frames) {
  std::printf("%s: accepted %zu of %zu", name.c_str(), tally.accepted, frames);
  if (!tally.mtre_mm.empty()) {
    std::printf(", mTRE median %.3f mm, worst %.3f mm; in-plane median %.3f mm, worst %.3f mm", median(tally.mtre_mm),
                largest(tally.mtre_mm), median(tally.inplane_mm), largest(tally.inplane_mm));
  }
  if (tally.accepted < frames) std::printf("; last refusal: %s", tally.last_reason.c_str());
  std::printf("\n");
}

/// In the order of the configuration.
std::vector<std::pair<std::string, Tally>> bodyTallies(const std::vector<FrameRecord>& records) {
  std::vector<std::pair<std::string, Tally>> tallies;
  for (const FrameRecord& record : records) {
    const std::vector<BodyResult>& bodies = record.outcome.result.bodies;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (i == tallies.size()) tallies.emplace_back(bodies[i].name, Tally{});
      const auto error = record.body_errors.find(bodies[i].name);
      tallies[i].second.add(bodies[i].accepted, bodies[i].reason,
                            error == record.body_errors.end() ? nullptr : &error->second);
    }
  }
  return tallies;
}

}  // namespace

json resultsJson(const RigidTransform& T_camera_ct_start, const Eigen::Vector3d& centre_ct_mm,
                 const std::vector<FrameRecord>& records) {
  json frames = json::array();
  for (const FrameRecord& record : records) frames.push_back(toJson(record, centre_ct_mm));
  return {{"start", toJson(T_camera_ct_start)}, {"frames", frames}};
}

void printSummary(const std::vector<FrameRecord>& records) {
  Tally ct;
  std::vector<double> total_ms;
  for (const FrameRecord& record : records) {
    const RegistrationResult& result = record.outcome.result;
    total_ms.push_back(record.outcome.total_ms);
    ct.add(result.accepted, result.reason, record.error ? &*record.error : nullptr);
  }
  std::printf("%zu of %zu frames accepted, median %.1f ms a frame\n", ct.accepted, records.size(), median(total_ms));
  printErrors(ct);
  if (ct.accepted < records.size()) std::printf("last refusal: %s\n", ct.last_reason.c_str());
  for (const auto& [name, tally] : bodyTallies(records)) printBody(name, tally, records.size());
}

void requireSomeAccepted(const std::vector<FrameRecord>& records) {
  const auto some_accepted = [](const FrameRecord& record) {
    const RegistrationResult& result = record.outcome.result;
    return result.accepted || std::any_of(result.bodies.begin(), result.bodies.end(),
                                          [](const BodyResult& body) { return body.accepted; });
  };
  if (std::any_of(records.begin(), records.end(), some_accepted)) return;
  if (records.empty()) throw std::runtime_error("the bag has no frames");
  throw std::runtime_error(
      "no frame was accepted; the last was refused because " + records.back().outcome.result.reason +
      ". Look at --overlay: the red edges of the DRR have to lie near the bones. If they do not, the start "
      "(--initial-pose, --initial-pose-topic) is wrong, which has to be good to about 15 degrees and 25 mm. If the DRR "
      "is bright where the X-ray is dark, set image/kind. If it has another size, the CT or camera_info's K is wrong");
}

}  // namespace xray_registration::tools

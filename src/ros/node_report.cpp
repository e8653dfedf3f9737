// What the node says of itself: diagnostics, and help on the console.
#include <diagnostic_msgs/DiagnosticStatus.h>
#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/console.h>
#include <ros/master.h>

#include <optional>
#include <string>
#include <vector>

#include "xray_registration/common/escaped.h"
#include "xray_registration/pipeline/health.h"
#include "xray_registration/ros/registration_node.h"

namespace xray_registration {

namespace {

/// Topics with images on them that others publish.
std::vector<std::string> imageTopics(const std::string& own_prefix) {
  ros::master::V_TopicInfo topics;
  ros::master::getTopics(topics);
  std::vector<std::string> names;
  for (const ros::master::TopicInfo& topic : topics) {
    const bool is_own = topic.name.compare(0, own_prefix.size(), own_prefix) == 0;
    if (topic.datatype == "sensor_msgs/Image" && !is_own) names.push_back(topic.name);
  }
  return names;
}

}  // namespace

void RegistrationNode::help() {
  ConsoleFacts facts;
  for (const Input& input : inputs_) {
    facts.inputs.push_back({input.image_topic, input.info_topic, input.image_publishers, input.images, input.infos});
  }
  facts.state = statistics_.snapshot().state;
  facts.tracks = parameters_.mode == Mode::kTrack;
  facts.waits_for_clock = ros::Time::isSimTime() && ros::Time::now().isZero();
  facts.initialpose_topic = service_node_.resolveName("initialpose");
  facts.set_initial_pose_service = private_node_.resolveName("set_initial_pose");
  const auto topics = [this] { return imageTopics(private_node_.getNamespace() + "/"); };
  for (const std::string& line : console_help_.advise(facts, ConsoleHelp::Clock::now(), topics)) {
    ROS_WARN_STREAM(escaped(line));
  }
}

namespace {

/// What is worth a warning: certain, and a fifth of what a frame is refused for.
bool isNoteworthy(const SetupSuspicion& suspicion, double limit_mm) {
  return suspicion.certain && (suspicion.unit.empty() || suspicion.effect_mm > 0.2 * limit_mm);
}

/// The estimates, and a warning for those that matter.
void addSuspicions(const std::vector<SetupSuspicion>& suspicions, double limit_mm,
                   diagnostic_updater::DiagnosticStatusWrapper* status) {
  for (const SetupSuspicion& suspicion : suspicions) {
    status->addf(suspicion.in_words, "looks %.3g ± %.2g %s off (moves the CT by %.2g mm)", suspicion.estimate,
                 suspicion.sigma, suspicion.unit.c_str(), suspicion.effect_mm);
    if (!isNoteworthy(suspicion, limit_mm)) continue;
    status->mergeSummary(diagnostic_msgs::DiagnosticStatus::WARN, suspicion.in_words + " looks wrong");
  }
}

void addAge(const char* name, const std::optional<double>& age_s, diagnostic_updater::DiagnosticStatusWrapper* status) {
  if (age_s) {
    status->addf(name, "%.1f", *age_s);
  } else {
    status->add(name, "none yet");
  }
}

/// What became of each body, and a warning that names those that were refused.
void addBodies(const std::vector<NodeStatistics::Body>& bodies, diagnostic_updater::DiagnosticStatusWrapper* status) {
  std::string refused;
  for (const NodeStatistics::Body& body : bodies) {
    status->add("body " + body.name, body.reason.empty() ? "accepted" : "refused: " + body.reason);
    if (!body.reason.empty()) refused += (refused.empty() ? "" : ", ") + body.name;
  }
  if (!refused.empty()) status->mergeSummary(diagnostic_msgs::DiagnosticStatus::WARN, "refused bodies: " + refused);
}

}  // namespace

void RegistrationNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  const NodeStatistics::Snapshot values = statistics_.snapshot();
  using Level = diagnostic_msgs::DiagnosticStatus;
  const HealthReport health = assessHealth(values, parameters_.health, parameters_.mode == Mode::kTrack);
  status.summary(static_cast<unsigned char>(health.level), health.summary);
  if (!worker_->enabled()) status.mergeSummary(Level::WARN, "switched off (~set_enabled)");
  status.add("state", toString(values.state));
  status.add("device", values.device);
  status.add("device bytes", values.device_bytes);
  status.add("CT", values.ct);
  status.addf("rate (frames/s)", "%.1f", values.rate_hz);
  status.addf("rate received (frames/s)", "%.1f", values.received_hz);
  status.addf("dropped (%)", "%.0f", 100.0 * values.dropped_share);
  addAge("age of the last image (s)", values.image_age_s, &status);
  addAge("age of the last accepted pose (s)", values.pose_age_s, &status);
  status.addf("latency, mean (ms)", "%.1f", values.latency_s * 1e3);
  status.addf("latency, largest (ms)", "%.1f", values.max_latency_s * 1e3);
  status.addf("solve, mean (ms)", "%.1f", values.solve_ms);
  status.add("frames received", values.received);
  status.add("frames registered", values.registered);
  status.add("frames accepted", values.accepted);
  status.add("frames dropped", values.dropped);
  status.add("frames refused", values.refused);
  status.add("last refusal", values.last_refusal);
  addBodies(values.bodies, &status);
  addSuspicions(values.suspicions, parameters_.registrar.accept.max_setup_error_mm, &status);
  status.add("last error", values.last_error);
}

}  // namespace xray_registration

#include "xray_registration/pipeline/health.h"

#include <cmath>
#include <cstdio>

namespace xray_registration {
namespace {

std::string withUnit(double value, const char* unit) {
  char text[48];
  std::snprintf(text, sizeof text, "%.1f %s", value, unit);
  return text;
}

std::string because(const std::string& reason) { return reason.empty() ? "" : ": " + reason; }

/// Nothing arrives, or nothing for too long.
HealthReport silence(const NodeStatistics::Snapshot& values, const HealthParameters& parameters) {
  const double age_s = values.image_age_s.value_or(values.uptime_s);
  const std::string since = values.image_age_s ? "no image for " + withUnit(age_s, "s")
                                               : "no image came yet, " + withUnit(age_s, "s") + " after the start";
  if (age_s > parameters.image_age_error_s) return {HealthLevel::kStale, since};
  if (age_s > parameters.image_age_warn_s) return {HealthLevel::kWarning, since};
  return {};
}

/// What is wrong while the CT is tracked.
HealthReport whileTracking(const NodeStatistics::Snapshot& values, const HealthParameters& parameters) {
  const double age_s = values.pose_age_s.value_or(0.0);
  if (age_s > parameters.pose_age_warn_s) {
    const bool error = age_s > parameters.pose_age_error_s;
    return {error ? HealthLevel::kError : HealthLevel::kWarning,
            "no pose accepted for " + withUnit(age_s, "s") + because(values.last_refusal)};
  }
  if (values.dropped_share > parameters.max_dropped) {
    return {HealthLevel::kWarning, withUnit(100.0 * values.dropped_share, "%") +
                                       " of the frames are dropped: they come faster than they are registered"};
  }
  if (values.rate_hz < parameters.min_rate_hz) {
    return {HealthLevel::kWarning, "only " + withUnit(values.rate_hz, "poses/s")};
  }
  return {HealthLevel::kOk,
          "tracking, " + withUnit(values.rate_hz, "poses/s") + ", the last one " + withUnit(age_s, "s") + " ago"};
}

}  // namespace

HealthReport assessHealth(const NodeStatistics::Snapshot& values, const HealthParameters& parameters, bool tracks) {
  if (values.state == TrackingState::kFault) return {HealthLevel::kError, "FAULT" + because(values.last_error)};
  if (values.state == TrackingState::kWaitingForCt) {
    return {HealthLevel::kWarning, "waiting for a CT (ct/path, ~load_ct)" + because(values.last_error)};
  }
  HealthReport silent = tracks ? silence(values, parameters) : HealthReport{};
  if (silent.level == HealthLevel::kStale) {
    return values.state == TrackingState::kLost ? HealthReport{silent.level, "LOST: " + silent.summary} : silent;
  }
  switch (values.state) {
    case TrackingState::kWaitingForPose:
      return {HealthLevel::kWarning, "waiting for a start (initial_pose, initialpose, ~set_initial_pose)"};
    case TrackingState::kLost: {
      const std::string since = values.pose_age_s ? "no pose accepted for " + withUnit(*values.pose_age_s, "s") : "";
      return {HealthLevel::kError, "LOST: " + since + because(values.last_refusal)};
    }
    default:
      break;
  }
  if (silent.level != HealthLevel::kOk) return silent;
  return tracks ? whileTracking(values, parameters) : HealthReport{HealthLevel::kOk, "registers on demand"};
}

}  // namespace xray_registration

#pragma once

#include <string>

#include "xray_registration/pipeline/node_statistics.h"

namespace xray_registration {

/// health/…
struct HealthParameters {
  double hold_timeout_s = 2.0;     ///< Held for longer (the same pixels, new stamps): LOST; 0: not looked at.
  double image_age_warn_s = 1.0;   ///< Since the last image, whatever became of it.
  double image_age_error_s = 5.0;  ///< Then diagnostics are STALE.
  double pose_age_warn_s = 1.0;    ///< Since the last accepted pose.
  double pose_age_error_s = 5.0;   ///< So long without a frame that could be looked at, the CT is LOST.
  double min_rate_hz = 0.0;        ///< Fewer accepted poses: WARN.
  double max_dropped = 0.5;        ///< A larger share of the frames dropped: WARN.
};

/// As diagnostic_msgs/DiagnosticStatus has them.
enum class HealthLevel { kOk = 0, kWarning = 1, kError = 2, kStale = 3 };

struct HealthReport {
  HealthLevel level = HealthLevel::kOk;
  std::string summary;  ///< One line for a person: what is, and since when.
};

/// What a node's numbers mean. `tracks`: every frame is to be registered (mode track); else a pose may be of any age.
HealthReport assessHealth(const NodeStatistics::Snapshot& values, const HealthParameters& parameters, bool tracks);

}  // namespace xray_registration

#include "xray_registration/pipeline/health.h"

#include <gtest/gtest.h>

#include <vector>

namespace xray_registration {
namespace {

/// A node that tracks.
NodeStatistics::Snapshot good() {
  NodeStatistics::Snapshot values;
  values.state = TrackingState::kTracking;
  values.uptime_s = 100.0;
  values.image_age_s = 0.05;
  values.pose_age_s = 0.07;
  values.rate_hz = 14.8;
  return values;
}

void expectReport(const NodeStatistics::Snapshot& values, HealthLevel level, const std::vector<const char*>& words,
                  const HealthParameters& parameters = {}, bool tracks = true) {
  const HealthReport report = assessHealth(values, parameters, tracks);
  EXPECT_EQ(report.level, level) << report.summary;
  for (const char* word : words) EXPECT_NE(report.summary.find(word), std::string::npos) << report.summary;
}

TEST(Health, IsGoodWhileTracking) { expectReport(good(), HealthLevel::kOk, {"tracking", "14.8 poses/s", "0.1 s ago"}); }

TEST(Health, SilenceIsAWarningThenStale) {
  NodeStatistics::Snapshot values = good();
  values.image_age_s = 2.0;
  expectReport(values, HealthLevel::kWarning, {"no image for 2.0 s"});
  values.image_age_s = 6.0;
  expectReport(values, HealthLevel::kStale, {"no image for 6.0 s"});
  values.state = TrackingState::kLost;
  expectReport(values, HealthLevel::kStale, {"LOST", "no image for 6.0 s"});
}

TEST(Health, InputThatNeverCameIsStale) {
  NodeStatistics::Snapshot values;
  values.state = TrackingState::kWaitingForPose;
  values.uptime_s = 3.0;
  expectReport(values, HealthLevel::kWarning, {"start"});
  values.uptime_s = 60.0;
  expectReport(values, HealthLevel::kStale, {"no image came yet"});
}

TEST(Health, RefusedInputIsAWarningThenAnError) {
  NodeStatistics::Snapshot values = good();
  values.last_refusal = "no camera_info came";
  values.pose_age_s = 2.0;
  expectReport(values, HealthLevel::kWarning, {"no pose accepted for 2.0 s: no camera_info came"});
  values.pose_age_s = 6.0;
  expectReport(values, HealthLevel::kError, {"no pose accepted for 6.0 s: no camera_info came"});
  values.state = TrackingState::kLost;
  values.pose_age_s = 1.5;
  expectReport(values, HealthLevel::kError, {"LOST", "1.5 s", "no camera_info came"});
}

TEST(Health, SaysWhatIsWaitedFor) {
  NodeStatistics::Snapshot values = good();
  values.state = TrackingState::kWaitingForCt;
  expectReport(values, HealthLevel::kWarning, {"CT", "~load_ct"});
  values.state = TrackingState::kWaitingForPose;
  expectReport(values, HealthLevel::kWarning, {"initial_pose", "initialpose", "~set_initial_pose"});
  values.state = TrackingState::kFault;
  values.last_error = "no device";
  expectReport(values, HealthLevel::kError, {"FAULT: no device"});
}

TEST(Health, DroppedFramesAndLowRatesAreWarnings) {
  NodeStatistics::Snapshot values = good();
  values.dropped_share = 0.6;
  expectReport(values, HealthLevel::kWarning, {"60.0 %", "dropped"});
  values.dropped_share = 0.0;
  HealthParameters parameters;
  parameters.min_rate_hz = 20.0;
  expectReport(values, HealthLevel::kWarning, {"14.8 poses/s"}, parameters);
}

TEST(Health, OnDemandNothingIsTooOld) {
  NodeStatistics::Snapshot values = good();
  values.image_age_s = values.pose_age_s = 1000.0;
  expectReport(values, HealthLevel::kOk, {"on demand"}, {}, false);
}

}  // namespace
}  // namespace xray_registration

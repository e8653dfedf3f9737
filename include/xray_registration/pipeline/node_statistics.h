#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/registration/suspicion.h"
#include "xray_registration/registration/tracker.h"

namespace xray_registration {

/// What a live worker has done so far, for status and diagnostics. Thread-safe.
class NodeStatistics {
 public:
  /// Of a body in the newest frame that was looked at.
  struct Body {
    std::string name;
    std::string reason;  ///< Why it was not accepted; empty when it was.
  };

  struct Snapshot {
    TrackingState state = TrackingState::kWaitingForCt;
    std::string device;
    std::size_t device_bytes = 0;
    std::string ct;
    std::uint64_t received = 0;
    std::uint64_t registered = 0;  ///< Reached the solver.
    std::uint64_t accepted = 0;
    std::uint64_t dropped = 0;
    std::uint64_t refused = 0;
    std::string last_error;    ///< Of the device, a CT, a pose or a parameter; not the reason of a refused frame.
    std::string last_refusal;  ///< Reason of the newest refused frame.
    std::vector<SetupSuspicion> suspicions;  ///< Of the newest registered frame.
    std::vector<Body> bodies;
    double latency_s = 0.0;  ///< Mean over the window.
    double max_latency_s = 0.0;
    double solve_ms = 0.0;
    double rate_hz = 0.0;               ///< Frames that were accepted, on the wall's clock.
    double received_hz = 0.0;           ///< Frames and refused images.
    double dropped_share = 0.0;         ///< Of the frames of the window.
    double uptime_s = 0.0;              ///< Since these statistics began.
    std::optional<double> image_age_s;  ///< Since the last image, whatever became of it; nothing before the first.
    std::optional<double> pose_age_s;   ///< Since the last accepted frame.
  };

  void frameReceived();
  void frameDropped();
  void frameRefused(const std::string& reason);
  /// The solver ran; then comes frameAccepted or frameRefused.
  void frameRegistered();
  void setSuspicions(const std::vector<SetupSuspicion>& suspicions);
  void setBodies(std::vector<Body> bodies);
  void frameAccepted(double latency_s, double solve_ms);

  void setState(TrackingState state);
  void setDevice(const std::string& name, std::size_t bytes);
  void setCt(const std::string& name);
  void setError(const std::string& error);

  Snapshot snapshot() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Accepted {
    Clock::time_point when;
    double latency_s = 0.0;
    double solve_ms = 0.0;
  };
  /// When something happened, of the last five seconds.
  using Times = std::deque<Clock::time_point>;
  static void note(Times* times);

  mutable std::mutex mutex_;
  Snapshot values_;
  Clock::time_point start_ = Clock::now();
  std::optional<Clock::time_point> last_image_;
  std::optional<Clock::time_point> last_accepted_;
  Times received_;
  Times dropped_;
  std::deque<Accepted> window_;  ///< The last five seconds.
};

}  // namespace xray_registration

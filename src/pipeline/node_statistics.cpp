#include "xray_registration/pipeline/node_statistics.h"

#include <algorithm>
#include <utility>

#include "xray_registration/common/escaped.h"

namespace xray_registration {

namespace {

constexpr std::chrono::seconds kWindow{5};
constexpr double kWindow_s = std::chrono::duration<double>(kWindow).count();

using TimePoint = std::chrono::steady_clock::time_point;

double secondsSince(TimePoint then, TimePoint now) { return std::chrono::duration<double>(now - then).count(); }

std::optional<double> secondsSince(const std::optional<TimePoint>& then, TimePoint now) {
  return then ? std::optional<double>(secondsSince(*then, now)) : std::nullopt;
}

double countSince(const std::deque<TimePoint>& times, TimePoint begin) {
  return static_cast<double>(std::count_if(times.begin(), times.end(), [&](TimePoint time) { return time >= begin; }));
}

}  // namespace

void NodeStatistics::note(Times* times) {
  const Clock::time_point now = Clock::now();
  times->push_back(now);
  while (now - times->front() > kWindow) times->pop_front();
}

void NodeStatistics::frameReceived() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.received;
  last_image_ = Clock::now();
  note(&received_);
}

void NodeStatistics::frameDropped() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.dropped;
  note(&dropped_);
}

void NodeStatistics::frameRefused(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.refused;
  values_.last_refusal = escaped(reason);
}

void NodeStatistics::frameRegistered() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.registered;
}

void NodeStatistics::frameAccepted(double latency_s, double solve_ms) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.accepted;
  const Clock::time_point now = Clock::now();
  last_accepted_ = now;
  window_.push_back({now, latency_s, solve_ms});
  while (now - window_.front().when > kWindow) window_.pop_front();
}

void NodeStatistics::setSuspicions(const std::vector<SetupSuspicion>& suspicions) {
  const std::lock_guard<std::mutex> lock(mutex_);
  values_.suspicions = suspicions;
}

void NodeStatistics::setBodies(std::vector<Body> bodies) {
  const std::lock_guard<std::mutex> lock(mutex_);
  values_.bodies = std::move(bodies);
}

void NodeStatistics::setState(TrackingState state) {
  const std::lock_guard<std::mutex> lock(mutex_);
  values_.state = state;
}

void NodeStatistics::setDevice(const std::string& name, std::size_t bytes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  values_.device = name;
  values_.device_bytes = bytes;
}

void NodeStatistics::setCt(const std::string& name) {
  const std::lock_guard<std::mutex> lock(mutex_);
  values_.ct = escaped(name);
}

void NodeStatistics::setError(const std::string& error) {
  const std::lock_guard<std::mutex> lock(mutex_);
  values_.last_error = escaped(error);
}

NodeStatistics::Snapshot NodeStatistics::snapshot() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Snapshot result = values_;
  const Clock::time_point now = Clock::now();
  int count = 0;
  for (const Accepted& frame : window_) {
    if (now - frame.when > kWindow) continue;
    ++count;
    result.latency_s += frame.latency_s;
    result.max_latency_s = std::max(result.max_latency_s, frame.latency_s);
    result.solve_ms += frame.solve_ms;
  }
  if (count > 0) {
    result.latency_s /= count;
    result.solve_ms /= count;
  }
  result.uptime_s = secondsSince(start_, now);
  result.rate_hz = count / kWindow_s;
  const double received = countSince(received_, now - kWindow);
  result.received_hz = received / kWindow_s;
  if (received > 0.0) result.dropped_share = std::min(1.0, countSince(dropped_, now - kWindow) / received);
  result.image_age_s = secondsSince(last_image_, now);
  result.pose_age_s = secondsSince(last_accepted_, now);
  return result;
}

}  // namespace xray_registration

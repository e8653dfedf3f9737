#include "xray_registration/pipeline/node_statistics.h"

#include <algorithm>
#include <utility>

namespace xray_registration {

namespace {

constexpr std::chrono::seconds kWindow{5};

}  // namespace

void NodeStatistics::frameReceived() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.received;
}

void NodeStatistics::frameDropped() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.dropped;
}

void NodeStatistics::frameRefused(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.refused;
  values_.last_refusal = reason;
}

void NodeStatistics::frameRegistered() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.registered;
}

void NodeStatistics::frameAccepted(double latency_s, double solve_ms) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++values_.accepted;
  const Clock::time_point now = Clock::now();
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
  values_.ct = name;
}

void NodeStatistics::setError(const std::string& error) {
  const std::lock_guard<std::mutex> lock(mutex_);
  values_.last_error = error;
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
  result.rate_hz = count / std::chrono::duration<double>(kWindow).count();
  return result;
}

}  // namespace xray_registration

#pragma once

namespace xray_registration {

/// Stamps that are older belong to another clock than the node's: a bag that is played without --clock.
constexpr double kOldestLatency_s = 60.0;

/// How old a frame is, in seconds: since its stamp, or since it came where the stamp is of another clock and would give
/// years, or where there is none. `comparable`: there is a stamp, and the node's clock has begun.
inline double frameLatency(bool comparable, double since_stamp_s, double since_arrival_s) {
  return comparable && since_stamp_s <= kOldestLatency_s ? since_stamp_s : since_arrival_s;
}

}  // namespace xray_registration

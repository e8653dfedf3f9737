#include "xray_registration/pipeline/stamp_guard.h"

#include <algorithm>
#include <cstdio>

#include "xray_registration/pipeline/frame_latency.h"

namespace xray_registration {
namespace {

// Clocks that nobody sets drift apart by a tenth of that, so that the way here never seems to become longer by it.
constexpr double kLargestDrift = 1e-3;

double seconds(std::chrono::nanoseconds time) { return std::chrono::duration<double>(time).count(); }

double age(const ImageArrival& image) { return seconds(image.now - image.stamp); }

/// "0.05 s", "3600 s".
std::string inSeconds(double time_s) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f s", time_s < 1.0 ? 3 : 1, time_s);
  return text;
}

/// What has passed between two images: by the node's clock, which a recording may run faster, or by the steady one,
/// which goes on while a simulated clock stands.
double secondsPassed(const ImageArrival& before, const ImageArrival& image) {
  return std::max({0.0, seconds(image.now - before.now), seconds(image.at - before.at)});
}

}  // namespace

std::string StampGuard::problemByItself(const ImageArrival& image, StampVerdict* verdict) const {
  if (image.stamp == std::chrono::nanoseconds::zero()) {
    *verdict = StampVerdict::kNone;
    return "the image has no stamp (it is zero)";
  }
  if (simulated_ && image.now == std::chrono::nanoseconds::zero()) {
    *verdict = StampVerdict::kNoClock;
    return "simulated time (use_sim_time) has not begun: nothing came on /clock; play the bag with --clock, or set "
           "use_sim_time to false";
  }
  const double ahead_s = seconds(image.stamp - image.now);
  if (ahead_s <= parameters_.max_ahead_s) return "";
  *verdict = StampVerdict::kAhead;
  return "the image's stamp is " + inSeconds(ahead_s) + " ahead of this node's clock (stamps/max_ahead allows " +
         inSeconds(parameters_.max_ahead_s) + "); set the clocks of camera and node by NTP or PTP";
}

bool StampGuard::follows(const ImageArrival& image, const ImageArrival& before) const {
  const double step_s = seconds(image.stamp - before.stamp);
  return step_s > 0.0 && step_s <= secondsPassed(before, image) + parameters_.max_jump_s;
}

/// Or as images do that waited together on the way: the newest of them is far from the first, but not younger than
/// images are.
bool StampGuard::followsLast(const ImageArrival& image) const {
  const bool young = age(image) < least_age_s_ - parameters_.max_jump_s;
  return follows(image, *last_) || (image.stamp > last_->stamp && !young);
}

std::string StampGuard::problemBesideLast(const ImageArrival& image, StampVerdict* verdict) const {
  if (!last_ || followsLast(image)) return "";
  if (image.stamp == last_->stamp) {
    *verdict = StampVerdict::kRepeated;
    return "a frame with this stamp was already handled";
  }
  const double step_s = seconds(image.stamp - last_->stamp);
  if (step_s < 0.0) {
    *verdict = StampVerdict::kBack;
    return "the image is older than the last one, by " + inSeconds(-step_s) + " of its stamp";
  }
  *verdict = StampVerdict::kJumped;
  return "the image's stamp is " + inSeconds(step_s) + " after the last one's, which came " +
         inSeconds(secondsPassed(*last_, image)) + " ago (stamps/max_jump allows " + inSeconds(parameters_.max_jump_s) +
         " more than that)";
}

/// The node's clock was set by what it is ahead of the steady one; with it, all images seem to be older.
void StampGuard::followNodesClock(const ImageArrival& image) {
  if (seen_ && !simulated_) least_age_s_ += seconds(image.now - seen_->now) - seconds(image.at - seen_->at);
  seen_ = image;
}

/// An image that waited in a network that was cut is in order, but shows what was. Replays are left out, which may be
/// slower than the clock: those in simulated time, and stamps of another clock.
std::string StampGuard::latenessProblem(const ImageArrival& image, StampVerdict* verdict) const {
  if (!last_ || simulated_ || least_age_s_ > kOldestLatency_s) return "";
  const double late_s = age(image) - least_age_s_;
  if (late_s <= parameters_.max_late_s) return "";
  *verdict = StampVerdict::kLate;
  return "the image is late: it came " + inSeconds(late_s) +
         " later after its stamp than others did (stamps/max_late "
         "allows " +
         inSeconds(parameters_.max_late_s) +
         "); it waited on the way here, or the camera's clock was set "
         "back while no images came: then call ~reset";
}

/// Whether this image makes a run of outlying ones long enough to be believed.
bool StampGuard::endsRun(const ImageArrival& image) {
  const int before = run_ && follows(image, run_->last) ? run_->count : 0;
  run_ = Run{image, before + 1};
  return run_->count >= parameters_.frames_until_new;
}

StampJudgement StampGuard::judge(const ImageArrival& image) {
  StampJudgement judgement;
  followNodesClock(image);
  judgement.problem = problemByItself(image, &judgement.verdict);
  if (!judgement.problem.empty()) return judgement;
  judgement.problem = problemBesideLast(image, &judgement.verdict);
  if (!judgement.problem.empty()) {
    if (!endsRun(image)) return judgement;
    const bool again = simulated_ && image.stamp <= last_->stamp;
    judgement = {again ? StampVerdict::kRecordingAgain : StampVerdict::kClockSet, ""};
  } else {
    judgement.problem = latenessProblem(image, &judgement.verdict);
    if (!judgement.problem.empty()) return judgement;
  }
  const bool same_clock = last_ && judgement.verdict == StampVerdict::kNext;
  least_age_s_ =
      same_clock ? std::min(least_age_s_ + kLargestDrift * secondsPassed(*last_, image), age(image)) : age(image);
  last_ = image;
  run_.reset();
  return judgement;
}

void StampGuard::forget() {
  last_.reset();
  run_.reset();
}

}  // namespace xray_registration

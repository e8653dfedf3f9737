#include "xray_registration/pipeline/picture_budget.h"

#include <algorithm>
#include <vector>

#include "xray_registration/common/statistics.h"

namespace xray_registration {
namespace {

constexpr std::size_t kGaps = 9;
constexpr std::size_t kEnoughGaps = 3;  // Fewer say nothing of a rate.
constexpr double kFading = 0.8;
constexpr double kRest = 9.0;  // Of the time that a picture took: pictures take a tenth.

double secondsBetween(PictureBudget::Clock::time_point from, PictureBudget::Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

PictureBudget::Clock::duration toDuration(double seconds) {
  return std::chrono::duration_cast<PictureBudget::Clock::duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

void PictureBudget::frameCame(Clock::time_point arrived) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (last_came_) gaps_s_.push_back(secondsBetween(*last_came_, arrived));
  if (gaps_s_.size() > kGaps) gaps_s_.pop_front();
  last_came_ = arrived;
}

void PictureBudget::made(Clock::time_point start, Clock::time_point end) {
  cost_s_ = std::max(secondsBetween(start, end), kFading * cost_s_);
  last_end_ = end;
}

bool PictureBudget::fitsBeforeTheNext(Clock::time_point arrived, Clock::time_point now) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (last_came_ && *last_came_ > arrived) return false;  // It is there already.
  if (gaps_s_.size() < kEnoughGaps) return true;
  const double gap_s = median(std::vector<double>(gaps_s_.begin(), gaps_s_.end()));
  return secondsBetween(arrived, now) + cost_s_ <= gap_s;
}

PictureBudget::Clock::time_point PictureBudget::due(Clock::time_point arrived, Clock::time_point now) const {
  if (cost_s_ == 0.0 || fitsBeforeTheNext(arrived, now)) return now;
  return std::max(now, last_end_ + toDuration(kRest * cost_s_));
}

}  // namespace xray_registration

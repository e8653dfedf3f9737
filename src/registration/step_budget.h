#pragma once

namespace xray_registration {

/// What one frame may cost. Every evaluation of the objective is drawn from it, be it of one pose or of a batch in one
/// launch, over all views: so it bounds the latency, and what was drawn is the work done.
class StepBudget {
 public:
  explicit StepBudget(int steps) : allowed_(steps) {}

  /// Draws one evaluation; false when none is left.
  bool draw() {
    if (used_ < allowed_) {
      ++used_;
      return true;
    }
    exceeded_ = true;
    return false;
  }

  int used() const { return used_; }
  int allowed() const { return allowed_; }
  bool exceeded() const { return exceeded_; }  ///< More was asked for than was allowed.

 private:
  int allowed_;
  int used_ = 0;
  bool exceeded_ = false;
};

}  // namespace xray_registration

#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace xray_registration {

/// stamps/…
struct StampParameters {
  double max_ahead_s = 0.5;  ///< max_ahead: how far a stamp may be ahead of the node's clock.
  double max_jump_s = 1.0;   ///< max_jump: how far one may run ahead of the time that has passed.
  double max_late_s = 1.0;   ///< max_late: how much older than others an image may be when it comes.
  int frames_until_new = 3;  ///< So many outlying stamps in a row, consistent with each other, are the new ones.
};

/// When an image was taken, and when it came.
struct ImageArrival {
  std::chrono::nanoseconds stamp{0};  ///< Since the clock's own zero.
  std::chrono::nanoseconds now{0};    ///< The node's clock, which may be simulated; zero until that one has begun.
  std::chrono::steady_clock::time_point at;
};

enum class StampVerdict {
  kNext,            ///< In order.
  kClockSet,        ///< In order with a few before it that lay elsewhere: the camera's clock was set.
  kRecordingAgain,  ///< The same in simulated time, and back: another recording, or the same from its start.
  kNone,            ///< Refused: zero.
  kNoClock,         ///< Refused: simulated time has not begun.
  kAhead,           ///< Refused: of a time that is still to come.
  kRepeated,        ///< Refused: the last one's.
  kBack,            ///< Refused: older than the last one.
  kJumped,          ///< Refused: further on than the time that has passed.
  kLate,            ///< Refused: it waited on the way; where the CT is now it does not say.
};

struct StampJudgement {
  StampVerdict verdict = StampVerdict::kNext;
  std::string problem;  ///< Why the image is refused and what to do, in words; empty when it is taken.
};

/// Guards what follows the stamps of one camera against those that lie: what is refused changes nothing for the images
/// after it. A run of images whose stamps lie elsewhere, but follow each other as time passes, is believed in the end:
/// then the clock was set, or a recording began again. Not thread-safe.
class StampGuard {
 public:
  /// `simulated`: the node's clock is that of a recording or a simulation, not the wall's.
  StampGuard(const StampParameters& parameters, bool simulated) : parameters_(parameters), simulated_(simulated) {}

  /// To be told of every image of the camera, in the order of their arrival.
  StampJudgement judge(const ImageArrival& image);

  /// Whatever comes next is the first.
  void forget();

 private:
  struct Run {
    ImageArrival last;
    int count = 0;
  };

  std::string problemByItself(const ImageArrival& image, StampVerdict* verdict) const;
  std::string problemBesideLast(const ImageArrival& image, StampVerdict* verdict) const;
  bool follows(const ImageArrival& image, const ImageArrival& before) const;
  bool followsLast(const ImageArrival& image) const;
  bool endsRun(const ImageArrival& image);
  void followNodesClock(const ImageArrival& image);
  std::string latenessProblem(const ImageArrival& image, StampVerdict* verdict) const;

  StampParameters parameters_;
  bool simulated_;
  std::optional<ImageArrival> last_;  ///< That was taken.
  double least_age_s_ = 0.0;          ///< Of those taken since the clock was set: how long the way here takes.
  std::optional<ImageArrival> seen_;  ///< The last one, whatever became of it.
  std::optional<Run> run_;            ///< Of refused ones, since the last that was taken.
};

}  // namespace xray_registration

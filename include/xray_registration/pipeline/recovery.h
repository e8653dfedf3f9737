#pragma once

#include "xray_registration/registration/tracker.h"

namespace xray_registration {

/// What LOST does by itself (parameter tracking/recover).
enum class Recover {
  kOff,    ///< Waits for a pose.
  kLocal,  ///< Every frame is a cold start from where the CT was last seen.
  kWide,   ///< After some of these, a wide search around it, in slices between the frames; then again.
};

/// How far from where the CT was last seen the wide search looks, and for how long at a frame.
constexpr double kRecoverRotationRad = 1.05;
constexpr double kRecoverTranslationMm = 100.0;
constexpr double kRecoverSliceMs = 30.0;

/// Chooses what becomes of each frame while the CT is LOST.
class Recovery {
 public:
  enum class Step {
    kRegister,  ///< As any frame.
    kWait,      ///< Refused: nothing is looked for.
    kSearch,    ///< A slice of the wide search.
  };

  Step next(Recover recover, TrackingState state) const;
  /// A frame was registered, from wherever: the wide search has its turn after some refusals.
  void note(bool accepted);
  /// The wide search is through: frames are registered from where the CT was last seen again.
  void searched() { refused_ = 0; }

 private:
  static constexpr int kLocalTries = 3;
  int refused_ = 0;
};

}  // namespace xray_registration

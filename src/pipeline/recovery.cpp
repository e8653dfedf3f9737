#include "xray_registration/pipeline/recovery.h"

namespace xray_registration {

Recovery::Step Recovery::next(Recover recover, TrackingState state) const {
  if (state != TrackingState::kLost) return Step::kRegister;
  if (recover == Recover::kOff) return Step::kWait;
  return recover == Recover::kWide && refused_ >= kLocalTries ? Step::kSearch : Step::kRegister;
}

void Recovery::note(bool accepted) { refused_ = accepted ? 0 : refused_ + 1; }

}  // namespace xray_registration

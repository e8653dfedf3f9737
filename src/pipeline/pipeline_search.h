#pragma once

#include <memory>

#include "xray_registration/pipeline/registration_pipeline.h"

namespace xray_registration {

/// A wide search and the frame that it looks at.
struct PipelineSearch {
  double stamp_s = 0.0;
  FrameOutcome frame;  ///< Its views; nothing was found yet.
  std::unique_ptr<WideSearch> search;
  std::string failure;  ///< Why it cannot go on; empty: it can.
};

}  // namespace xray_registration

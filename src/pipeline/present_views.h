#pragma once

#include <optional>
#include <vector>

#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// The views of a frame that are there.
inline std::vector<ViewInput> presentViews(const std::vector<std::optional<ViewInput>>& views) {
  std::vector<ViewInput> found;
  for (const std::optional<ViewInput>& view : views) {
    if (view) found.push_back(*view);
  }
  return found;
}

}  // namespace xray_registration

#include "held_views.h"

#include <algorithm>
#include <cstdio>

namespace xray_registration {

std::string heldProblem(const ViewMessage& view) {
  if (!view.held_for_s) return "";
  char text[128];
  std::snprintf(text, sizeof text, "the image is held: its pixels are those of the image %.1f s before",
                *view.held_for_s);
  return text;
}

std::string heldProblem(const FrameMessages& frame, const std::vector<std::string>& names, bool allow_missing_view) {
  std::string problem;
  bool some_new = false;
  for (std::size_t i = 0; i < frame.views.size(); ++i) {
    const std::string held = heldProblem(frame.views[i]);
    some_new = some_new || (held.empty() && frame.views[i].image);
    if (held.empty()) continue;
    if (!problem.empty()) problem += "; ";
    if (!names[i].empty()) problem += "view '" + names[i] + "': ";
    problem += held;
  }
  return some_new && allow_missing_view ? "" : problem;
}

double longestHeld(const FrameMessages& frame) {
  double longest_s = 0.0;
  for (const ViewMessage& view : frame.views) longest_s = std::max(longest_s, view.held_for_s.value_or(0.0));
  return longest_s;
}

}  // namespace xray_registration

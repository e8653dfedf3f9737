#include "xray_registration/pipeline/drr_parts.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "xray_registration/image/image_pyramid.h"

namespace xray_registration {
namespace {

void add(const FloatImage& part, FloatImage* sum) {
  if (part.empty()) return;
  if (sum->empty()) {
    *sum = part;
    return;
  }
  std::transform(part.pixels.begin(), part.pixels.end(), sum->pixels.begin(), sum->pixels.begin(), std::plus<>());
}

Rgb colourOf(const std::string& name, const std::vector<BodyParameters>& bodies) {
  const auto found =
      std::find_if(bodies.begin(), bodies.end(), [&](const BodyParameters& body) { return body.name == name; });
  return bodyColour(static_cast<std::size_t>(found - bodies.begin()));
}

}  // namespace

FloatImage acceptedDrr(const DrrParts& parts, const RegistrationResult& result) {
  FloatImage sum;
  if (result.accepted) add(parts.ct, &sum);
  for (std::size_t i = 0; i < parts.bodies.size(); ++i) {
    if (result.bodies[i].accepted) add(parts.bodies[i], &sum);
  }
  return sum;
}

std::vector<OverlayLine> overlayLines(const DrrParts& parts, const RegistrationResult& result,
                                      const std::vector<BodyParameters>& bodies) {
  std::vector<OverlayLine> lines;
  if (!parts.ct.empty()) lines.push_back({&parts.ct, result.accepted ? kAcceptedColour : kRefusedColour});
  for (std::size_t i = 0; i < parts.bodies.size(); ++i) {
    if (parts.bodies[i].empty()) continue;
    const BodyResult& body = result.bodies[i];
    lines.push_back(
        {&parts.bodies[i], body.accepted ? colourOf(body.name, bodies) : kRefusedColour, true, !body.accepted});
  }
  return lines;
}

ViewInput forDisplay(const ViewInput& view) {
  constexpr int kLargestSide = 800;
  const XrayFrame& full = *view.xray;
  const int side = std::max(full.attenuation.width(), full.attenuation.height());
  const int factor = (side + kLargestSide - 1) / kLargestSide;
  if (factor <= 1) return view;
  ViewInput shown(std::make_shared<const XrayFrame>(binned(full, factor)), view.T_view_first);
  shown.name = view.name;
  return shown;
}

}  // namespace xray_registration

#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace xray_registration {

/// What X-ray and DRR are compared by. The list is similarities.def.
enum class Similarity {
#define XRAY_SIMILARITY(enumerator, name, sums, span, finest_span, flat, contrast, description) enumerator,
#include "xray_registration/drr/similarities.def"
#undef XRAY_SIMILARITY
};

/// One line of similarities.def, which says what the members mean.
struct SimilarityKind {
  Similarity similarity;
  const char* name;
  const char* sums;  ///< Kernel that adds up a tile.
  int span;
  int finest_span;
  double flat;
  double contrast;
  const char* description;
};

/// All, in the order of the enumeration.
inline constexpr SimilarityKind kSimilarities[] = {
#define XRAY_SIMILARITY(enumerator, name, sums, span, finest_span, flat, contrast, description) \
  {Similarity::enumerator, #name, #sums, span, finest_span, flat, contrast, description},
#include "xray_registration/drr/similarities.def"
#undef XRAY_SIMILARITY
};

constexpr const SimilarityKind& kindOf(Similarity similarity) {
  return kSimilarities[static_cast<std::size_t>(similarity)];
}

/// Nothing when no similarity has that name.
std::optional<Similarity> similarityNamed(const std::string& name);

/// How tiles are joined into windows, and how windows count.
struct WindowOptions {
  Similarity similarity = Similarity::kLocalNormalised;
  int span = 2;                  ///< Tiles (of 8 pixels) along a window's side; windows overlap, one per tile. 0: one
                                 ///< window over the whole image.
  double epsilon_value = 0.005;  ///< Deviation of the DRR below which a window counts as flat.
  double epsilon_xray = 0.005;   ///< The same for the X-ray.
  double robust_scale2 = 1e6;    ///< Geman-McClure scale on 1 − correlation; large is no robustness.
  double contrast = 0.3;         ///< Deviation of the X-ray at which a window counts half.
};

/// A similarity's own options for an X-ray of that deviation (ResidentXray::deviation); windows as on coarse levels,
/// not robust.
WindowOptions windowsFor(Similarity similarity, double xray_deviation);

}  // namespace xray_registration

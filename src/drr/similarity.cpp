#include "xray_registration/drr/similarity.h"

namespace xray_registration {

std::optional<Similarity> similarityNamed(const std::string& name) {
  for (const SimilarityKind& kind : kSimilarities) {
    if (kind.name == name) return kind.similarity;
  }
  return std::nullopt;
}

WindowOptions windowsFor(Similarity similarity, double xray_deviation) {
  const SimilarityKind& kind = kindOf(similarity);
  WindowOptions options;
  options.similarity = similarity;
  options.span = kind.span;
  options.epsilon_value = kind.flat;
  options.epsilon_xray = kind.flat * xray_deviation;
  options.contrast = kind.contrast * xray_deviation;
  return options;
}

}  // namespace xray_registration

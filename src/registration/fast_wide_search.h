#pragma once

#include <optional>
#include <vector>

#include "registration/frame_objective.h"
#include "registration/place_ranking.h"

namespace xray_registration {

/// The fast method's wide search: ranks (PlaceRanking), then refines the best on the coarsest level and on the next.
class FastWideSearch : public WideSearch {
 public:
  /// The engine has its CT and outlives this, as do the options. @throws DeviceError.
  FastWideSearch(Engine* engine, std::vector<ViewInput> inputs, const RegistrarOptions& options,
                 const WideSearchRange& range);

  bool advance() override;
  double progress() const override;
  double bestSimilarity() const override { return best_similarity_; }
  const std::vector<RigidTransform>& places() const override { return places_; }

 private:
  bool refine();
  void beginRefining();
  void beginLevel(const std::vector<RigidTransform>& starts);
  std::vector<StepSums> evaluate(const std::vector<RigidTransform>& poses);

  std::vector<ViewInput> inputs_;
  RegistrarOptions options_;
  PlaceRanking ranking_;
  StepBudget budget_;
  DeviceViews views_;
  FrameObjective objective_;
  Stage stage_;
  int coarsest_ = 0;
  int steps_ = 0;  ///< Of the refinement.
  std::optional<ManyDescents> descents_;
  std::vector<RigidTransform> places_;
  double best_similarity_ = -1.0;
};

}  // namespace xray_registration

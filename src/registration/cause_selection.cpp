#include "registration/cause_selection.h"

#include <Eigen/QR>
#include <algorithm>
#include <iterator>

namespace xray_registration {
namespace {

constexpr int kLevel = 1;
constexpr int kSteps = 12;
/// σ of the paired blocks by which a further cause has to explain the X-rays better.
constexpr double kBetter = 2.3;
/// Share of the cost that a further cause has to take away: less is the CT's own errors.
constexpr double kWorthAdding = 0.0025;
/// Share of the best cause's gain that is as good.
constexpr double kAsGood = 0.9;
/// What makes a camera that is wrong in one view alone as unlikely as a wrong pose between views.
constexpr int kOneViewAlone = 6;

struct Candidate {
  CalibratedGroups groups;
  JointSolution found;
};

CalibratedGroups named(const CalibratedGroups& groups, const char* what) {
  CalibratedGroups some;
  std::copy_if(groups.begin(), groups.end(), std::back_inserter(some),
               [what](const CalibratedGroup& group) { return group.what == what; });
  return some;
}

CalibratedGroups joined(const CalibratedGroups& groups, const char* without, const CalibratedGroups& added) {
  CalibratedGroups all;
  std::copy_if(groups.begin(), groups.end(), std::back_inserter(all),
               [without](const CalibratedGroup& group) { return group.what != without; });
  all.insert(all.end(), added.begin(), added.end());
  return all;
}

/// What a camera may be wrong by: in all views alike, or, where that is taken already, in each by itself.
void addCamera(const CalibratedGroups& present, const CalibratedGroups& single, const char* what,
               std::vector<CalibratedGroups>* extended) {
  const CalibratedGroups free = named(present, what);
  const CalibratedGroups each = named(single, what);
  if (free.empty()) extended->push_back(joined(present, what, {commonOf(each)}));
  if (each.size() > 1 && free.size() < each.size()) extended->push_back(joined(present, what, each));
}

/// By one cause more.
std::vector<CalibratedGroups> extensionsOf(const CalibratedGroups& present, const CalibratedGroups& single) {
  std::vector<CalibratedGroups> extended;
  addCamera(present, single, kFocalLength, &extended);
  addCamera(present, single, kPrincipalPoint, &extended);
  const CalibratedGroups poses = named(present, kViewPose);
  for (const CalibratedGroup& pose : named(single, kViewPose)) {
    const bool free = std::any_of(poses.begin(), poses.end(),
                                  [&](const CalibratedGroup& other) { return other.views == pose.views; });
    if (!free) extended.push_back(joined(present, "", {pose}));
  }
  return extended;
}

int complexityOf(const CalibratedGroups& groups) {
  int complexity = 0;
  for (const CalibratedGroup& group : groups) complexity += static_cast<int>(group.limits.size());
  for (const char* what : {kFocalLength, kPrincipalPoint}) {
    if (named(groups, what).size() > 1) complexity += kOneViewAlone;
  }
  return complexity;
}

/// What free parameters gain by fitting errors is ½ tr(S⁻¹ B) on average; three times that is no accident.
double chanceOf(const JointFrames& frames, const Candidate& candidate) {
  if (candidate.groups.empty()) return 0.0;
  const FreeParameters free(candidate.found.setup.views.size(), candidate.groups);
  const Score score = jointScore(frames, candidate.found, free);
  if (score.empty()) return 0.0;
  return 1.5 * std::max(score.curvature.completeOrthogonalDecomposition().solve(score.scatter).trace(), 0.0);
}

/// The simplest that gains nearly as much as the best; null without any.
const Candidate* simplest(const std::vector<Candidate>& candidates, double cost_before) {
  double most = 0.0;
  for (const Candidate& one : candidates) most = std::max(most, cost_before - one.found.evidence.cost);
  const Candidate* chosen = nullptr;
  for (const Candidate& one : candidates) {
    if (cost_before - one.found.evidence.cost < kAsGood * most) continue;
    if (chosen == nullptr || complexityOf(one.groups) < complexityOf(chosen->groups)) chosen = &one;
  }
  return chosen;
}

}  // namespace

CalibratedGroup commonOf(const CalibratedGroups& groups) {
  CalibratedGroup all = groups.front();
  for (const CalibratedGroup& group : groups) {
    if (!all.isOf(group.views.front())) all.views.push_back(group.views.front());
  }
  return all;
}

CalibratedGroups selectCauses(JointFrames* frames, const CalibratedGroups& single, const JointSetup& as_told) {
  const std::size_t views = as_told.views.size();
  const Stage stage = stageOn(std::min(kLevel, frames->lastLevel()), kSteps, Similarity::kLocalNormalised);
  Candidate present{{}, solveJointly(frames, stage, FreeParameters(views, {}), as_told)};
  for (;;) {
    const double cost = present.found.evidence.cost;
    std::vector<Candidate> better;
    for (const CalibratedGroups& groups : extensionsOf(present.groups, single)) {
      Candidate one{groups, solveJointly(frames, stage, FreeParameters(views, groups), present.found.setup,
                                         present.found.robust_scales2)};
      const double gain = cost - one.found.evidence.cost;
      const double chance = chanceOf(*frames, one) - chanceOf(*frames, present);
      const bool worth = gain - chance > kWorthAdding * cost;
      if (worth && betterBy(one.found.evidence, present.found.evidence) > kBetter) better.push_back(std::move(one));
    }
    const Candidate* chosen = simplest(better, cost);
    if (chosen == nullptr) return present.groups;
    present = *chosen;
  }
}

}  // namespace xray_registration

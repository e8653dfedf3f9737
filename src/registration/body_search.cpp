#include "registration/body_search.h"

#include <algorithm>
#include <utility>

#include "registration/in_plane_distance.h"
#include "registration/pose_search.h"

namespace xray_registration {
namespace {

constexpr int kCoarseSteps = 12;
constexpr int kFineSteps = 15;
constexpr int kRefiningSteps = 15;
constexpr int kTrackedFineSteps = 6;
/// Places of the coarse level that are looked at on the finest.
constexpr std::size_t kPlaces = 3;

/// The level above the finest, if there is one: a body is small, and searched for in a small range.
int coarseLevel(const DeviceViews& views) { return std::min(1, views.lastLevel()); }

Solution descend(BodyObjective* objective, const RigidTransform& start, int coarse_steps, int fine_steps) {
  Solution solution;
  solution.T_camera_ct = start;
  const int coarse = coarseLevel(objective->views());
  if (coarse > 0 && coarse_steps > 0) {
    objective->solve(bodyStage(coarse, coarse_steps), &solution);
    if (solution.failed) return solution;
  }
  objective->solve(bodyStage(0, fine_steps), &solution);
  return solution;
}

}  // namespace

BodySolution searchBody(BodyObjective* objective, const RigidTransform& T_camera_neutral, const RigidTransform& start) {
  const Stage coarse = bodyStage(coarseLevel(objective->views()), kCoarseSteps);
  std::vector<RigidTransform> places = {start};
  if (objective->options().search) {
    for (const RigidTransform& place : searchAround(objective, coarse, T_camera_neutral, 1, kPlaces)) {
      places.push_back(place);
    }
  }
  std::vector<Solution> found;
  found.reserve(places.size());
  for (const RigidTransform& place : places) found.push_back(descend(objective, place, kCoarseSteps, kFineSteps));
  const auto best = std::max_element(found.begin(), found.end(), [](const Solution& a, const Solution& b) {
    return !b.failed && (a.failed || a.sums.similarity < b.sums.similarity);
  });
  BodySolution result{*best, {}};
  for (const Solution& other : found) {
    if (other.failed) continue;
    const double distance_mm = inPlaneDistance(best->T_camera_ct, other.T_camera_ct, objective->views().centreCt());
    if (distance_mm < kOtherPlaceMm || other.sums.similarity <= result.rival.similarity) continue;
    result.rival = {other.sums.similarity, distance_mm};
  }
  return result;
}

Solution trackBody(BodyObjective* objective, const RigidTransform& start) {
  // A prediction is nearly there: the coarse level, and what surrounds the body on it, is only drawn where it was not.
  const Solution near = descend(objective, start, 0, kTrackedFineSteps);
  if (near.converged && !near.failed) return near;
  return descend(objective, start, kCoarseSteps, kFineSteps);
}

Solution refineBody(BodyObjective* objective, const RigidTransform& start) {
  return descend(objective, start, 0, kRefiningSteps);
}

}  // namespace xray_registration

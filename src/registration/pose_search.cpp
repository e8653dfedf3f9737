#include "registration/pose_search.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "registration/in_plane_distance.h"

namespace xray_registration {
namespace {

/// Poses that are refined; where only the best place is asked for.
constexpr std::size_t kRefined = 8;
constexpr std::size_t kRefinedForOne = 4;

/// Element `index` of the Halton sequence in `base`: fills the unit interval evenly, the same on every machine.
double halton(int index, int base) {
  double result = 0.0;
  double part = 1.0;
  for (; index > 0; index /= base) {
    part /= base;
    result += part * (index % base);
  }
  return result;
}

/// The start itself, then the poses around it.
std::vector<RigidTransform> posesAround(const RigidTransform& start, const Eigen::Vector3d& centre_ct,
                                        const RegistrarOptions& options, int first_index) {
  constexpr int kBases[6] = {2, 3, 5, 7, 11, 13};
  std::vector<RigidTransform> poses = {start};
  for (int i = first_index; i < first_index + options.search_poses; ++i) {
    Twist offset;
    for (int axis = 0; axis < 6; ++axis) {
      const double range = axis < 3 ? options.search_translation_mm : options.search_rotation_rad;
      offset[axis] = range * (2.0 * halton(i, kBases[axis]) - 1.0);
    }
    poses.push_back(updatedPose(start, offset, start * centre_ct));
  }
  return poses;
}

std::vector<RigidTransform> bestOf(const std::vector<RigidTransform>& poses, const std::vector<StepSums>& ranked,
                                   std::size_t count) {
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), 0);
  // The start itself always takes part.
  std::stable_sort(order.begin() + 1, order.end(),
                   [&](std::size_t a, std::size_t b) { return orderedCost(ranked[a]) < orderedCost(ranked[b]); });
  std::vector<RigidTransform> best;
  for (std::size_t i = 0; i < std::min(count, order.size()); ++i) best.push_back(poses[order[i]]);
  return best;
}

}  // namespace

double orderedCost(const StepSums& sums) {
  return sums.finite() && sums.weight > 0.0 ? sums.cost : std::numeric_limits<double>::infinity();
}

std::vector<RigidTransform> placesOf(std::vector<GaussNewtonResult> refined, const Eigen::Vector3d& centre_ct,
                                     std::size_t places) {
  std::stable_sort(refined.begin(), refined.end(),
                   [](const auto& a, const auto& b) { return orderedCost(a.sums) < orderedCost(b.sums); });
  std::vector<RigidTransform> found;
  for (const GaussNewtonResult& result : refined) {
    const bool known = std::any_of(found.begin(), found.end(), [&](const RigidTransform& other) {
      return inPlaneDistance(result.T_camera_ct, other, centre_ct) < kOtherPlaceMm;
    });
    if (!known && found.size() < places) found.push_back(result.T_camera_ct);
  }
  return found;
}

std::vector<RigidTransform> searchAround(FrameObjective* objective, const Stage& stage, const RigidTransform& start,
                                         int first_index, std::size_t places, double hopeless) {
  return searchAround(objective, stage, stage, start, first_index, places, hopeless);
}

std::vector<RigidTransform> searchAround(FrameObjective* objective, const Stage& ranked_on, const Stage& refined_on,
                                         const RigidTransform& start, int first_index, std::size_t places,
                                         double hopeless) {
  constexpr int kPatience = 5;
  const Eigen::Vector3d& centre_ct = objective->views().centreCt();
  const std::vector<RigidTransform> poses = posesAround(start, centre_ct, objective->options(), first_index);
  const std::vector<StepSums> ranked = objective->evaluate(ranked_on, kNotRobust, poses);
  if (ranked.empty()) return {start};
  int evaluations = 0;
  double most = -1.0;
  const auto batch = [&](const std::vector<RigidTransform>& asked) -> std::vector<StepSums> {
    if (evaluations++ >= kPatience && most < hopeless) return {};
    std::vector<StepSums> sums = objective->evaluate(refined_on, kNotRobust, asked);
    for (const StepSums& one : sums) most = std::max(most, one.similarity);
    return sums;
  };
  const std::vector<RigidTransform> refined = bestOf(poses, ranked, places == 1 ? kRefinedForOne : kRefined);
  return placesOf(minimiseMany(batch, refined, centre_ct, objective->solverFor(refined_on, start)), centre_ct, places);
}

}  // namespace xray_registration

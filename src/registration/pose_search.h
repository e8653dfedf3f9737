#pragma once

#include <vector>

#include "registration/frame_objective.h"

namespace xray_registration {

/// Ranks `solver/search_poses` poses around the start in one launch, refines the start and the best of them, eight in
/// all (four when one place is asked for), side by side, and gives the places that they found, best first, at most
/// `places`. The poses are elements `first_index` … of a Halton sequence: the same everywhere, and others for another
/// first index. When nothing is as alike as `hopeless` after some steps, it ends there.
std::vector<RigidTransform> searchAround(FrameObjective* objective, const Stage& stage, const RigidTransform& start,
                                         int first_index, std::size_t places, double hopeless = -1.0);

/// The same, ranked on one stage and refined on another, finer one.
std::vector<RigidTransform> searchAround(FrameObjective* objective, const Stage& ranked_on, const Stage& refined_on,
                                         const RigidTransform& start, int first_index, std::size_t places,
                                         double hopeless = -1.0);

/// A cost that can be compared: what is not finite comes last, and so does what was never evaluated.
double orderedCost(const StepSums& sums);

/// The places of refined poses, best first, at most `places`.
std::vector<RigidTransform> placesOf(std::vector<GaussNewtonResult> refined, const Eigen::Vector3d& centre_ct,
                                     std::size_t places);

}  // namespace xray_registration

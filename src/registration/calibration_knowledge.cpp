#include "registration/calibration_knowledge.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "registration/cause_selection.h"
#include "xray_registration/geometry/cross_matrix.h"
#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {
namespace {

/// σ from which X-rays contradict a pose as it was told: more than what a distortion leaves to it when all is free.
constexpr double kContradicted = 10.0;

JointSolution seenAsFinelyAsTheCt(JointFrames* frames, const JointSolution& solution) {
  const Stage stage = stageOn(frames->levelOfCt(solution.setup), 0, Similarity::kLocalNormalised);
  return solveJointly(frames, stage, FreeParameters(solution.setup.views.size(), {}), solution.setup);
}

/// By what factor a group's σ exceeds its limits.
double excessOf(const FreeParameters& free, std::size_t group, const Eigen::MatrixXd& covariance) {
  double most = 0.0;
  const Eigen::VectorXd& limits = free.groups()[group].limits;
  for (Eigen::Index i = 0; i < limits.size(); ++i) {
    const Eigen::Index place = free.placeOf(group) + i;
    const double excess = std::sqrt(std::max(covariance(place, place), 0.0)) / limits[i];
    most = std::max(most, std::isfinite(excess) ? excess : 1e12);
  }
  return most;
}

/// By how many σ, root mean square over its parameters, a view's pose is not what was told.
double deviationOf(const RigidTransform& told, const RigidTransform& found, const Eigen::Vector3d& centre_mm,
                   const Eigen::MatrixXd& covariance) {
  const Twist twist = twistBetween(told, found, told * centre_mm);
  const Eigen::VectorXd solved = covariance.completeOrthogonalDecomposition().solve(twist);
  return std::sqrt(std::max(twist.dot(solved), 0.0) / 6.0);
}

/// Of the groups the one that holds a view's parameter of this name; the end without one.
CalibratedGroups::const_iterator placeOf(const CalibratedGroups& groups, const CalibratedGroup& asked) {
  return std::find_if(groups.begin(), groups.end(), [&](const CalibratedGroup& group) {
    return group.what == asked.what && group.isOf(asked.views.front());
  });
}

/// Without the group at `least`; of several views by themselves, what all have alike may still be determined.
CalibratedGroups withLess(const CalibratedGroups& groups, std::size_t least) {
  const std::string what = groups[least].what;
  CalibratedGroups same;
  CalibratedGroups rest;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const bool together = what != kViewPose && groups[i].what == what;
    if (together) same.push_back(groups[i]);
    if (!together && i != least) rest.push_back(groups[i]);
  }
  if (same.size() > 1) rest.push_back(commonOf(same));
  return rest;
}

double largestSigma(const Eigen::MatrixXd& covariance) {
  return std::sqrt(std::max(covariance.diagonal().maxCoeff(), 0.0));
}
double lengthSigma(const Eigen::MatrixXd& covariance) { return std::sqrt(std::max(covariance.trace(), 0.0)); }

void addSigma(const CalibratedGroup& group, const Eigen::MatrixXd& covariance, const Eigen::Vector3d& centre_view_mm,
              ViewGeometrySigma* sigma) {
  if (group.what == kFocalLength) sigma->focal_scale = largestSigma(covariance);
  if (group.what == kPrincipalPoint) sigma->centre_px = largestSigma(covariance);
  if (group.what == kDistortion) sigma->radial = largestSigma(covariance);
  if (group.what != kViewPose) return;
  sigma->translation_mm = lengthSigma(covariance.topLeftCorner<3, 3>());
  sigma->rotation_rad = lengthSigma(covariance.bottomRightCorner<3, 3>());
  // The source is the camera's origin: against the CT's centre a turn moves it by ω × (0 − centre).
  Eigen::Matrix<double, 3, 6> at_source = Eigen::Matrix<double, 3, 6>::Zero();
  at_source.leftCols<3>().setIdentity();
  at_source.rightCols<3>() = crossMatrix(centre_view_mm);
  sigma->source_mm = lengthSigma(at_source * covariance * at_source.transpose());
}

}  // namespace

CalibrationKnowledge::CalibrationKnowledge(JointFrames* frames, const JointSolution& solution)
    : frames_(*frames), seen_(seenAsFinelyAsTheCt(frames, solution)) {}

bool CalibrationKnowledge::isContradicted(const CalibratedGroup& group, const Eigen::MatrixXd& covariance,
                                          const JointSetup& told) const {
  if (group.what != kViewPose) return false;
  const std::size_t view = group.views.front();
  return deviationOf(told.views[view].T_view_first, seen_.setup.views[view].T_view_first,
                     meanCentre(seen_.setup, frames_.centreCt()), covariance) > kContradicted;
}

std::size_t CalibrationKnowledge::leastDetermined(const FreeParameters& free, const JointSetup& told) const {
  std::size_t least = free.groups().size();
  const Score score = jointScore(frames_, seen_, free);
  if (score.empty()) return 0;
  const Eigen::MatrixXd covariance = jointCovariance(score);
  double most = 1.0;
  for (std::size_t i = 0; i < free.groups().size(); ++i) {
    const CalibratedGroup& group = free.groups()[i];
    const double excess = excessOf(free, i, covariance);
    const auto count = group.limits.size();
    const int first = free.placeOf(i);
    if (excess <= most || isContradicted(group, covariance.block(first, first, count, count), told)) continue;
    most = excess;
    least = i;
  }
  return least;
}

CalibratedGroups CalibrationKnowledge::determinedOf(CalibratedGroups groups, const JointSetup& told) const {
  while (!groups.empty()) {
    const std::size_t least = leastDetermined(FreeParameters(seen_.setup.views.size(), groups), told);
    if (least == groups.size()) break;
    groups = withLess(groups, least);
  }
  return groups;
}

GroupKnowledge CalibrationKnowledge::of(CalibratedGroups groups, const CalibratedGroup& asked) const {
  const auto index = static_cast<std::size_t>(placeOf(groups, asked) - groups.cbegin());
  if (index == groups.size()) groups.push_back(asked);
  const FreeParameters free(seen_.setup.views.size(), groups);
  const Score score = jointScore(frames_, seen_, free);
  GroupKnowledge knowledge;
  const auto count = asked.limits.size();
  knowledge.covariance = Eigen::MatrixXd::Zero(count, count);
  knowledge.estimate = Eigen::VectorXd::Zero(count);
  if (score.empty()) return knowledge;
  const Eigen::MatrixXd covariance = jointCovariance(score);
  const int first = free.placeOf(index);
  knowledge.determined = excessOf(free, index, covariance) <= 1.0;
  knowledge.covariance = covariance.block(first, first, count, count);
  const Eigen::VectorXd step = -score.curvature.completeOrthogonalDecomposition().solve(score.score);
  knowledge.estimate = step.segment(first, count);
  return knowledge;
}

CalibratedGroups CalibrationKnowledge::openBeside(const CalibratedGroups& groups,
                                                  const CalibratedGroups& single) const {
  CalibratedGroups open;
  for (const CalibratedGroup& group : single) {
    if (group.what == kDistortion || group.what == kViewPose) continue;
    if (placeOf(groups, group) != groups.end() || of(groups, group).determined) continue;
    const auto same =
        std::find_if(open.begin(), open.end(), [&](const CalibratedGroup& other) { return other.what == group.what; });
    if (same == open.end()) {
      open.push_back(group);
    } else {
      *same = commonOf({*same, group});  // One device took all views.
    }
  }
  return open;
}

std::vector<CalibratedView> CalibrationKnowledge::viewsOf(const CalibratedGroups& groups,
                                                          const CalibratedGroups& single) const {
  std::vector<CalibratedView> views;
  for (const ViewGeometry& geometry : seen_.setup.views) views.push_back({geometry, {}, {}});
  const Eigen::Vector3d centre = meanCentre(seen_.setup, frames_.centreCt());
  const CalibratedGroups open = openBeside(groups, single);
  CalibratedGroups free = groups;
  free.insert(free.end(), open.begin(), open.end());
  for (const CalibratedGroup& group : single) {
    CalibratedView& view = views[group.views.front()];
    const GroupKnowledge known = of(free, group);
    addSigma(group, known.covariance, view.geometry.T_view_first * centre, &view.sigma);
    if (!known.determined || placeOf(open, group) != open.end()) view.undetermined.push_back(group.what);
  }
  return views;
}

}  // namespace xray_registration

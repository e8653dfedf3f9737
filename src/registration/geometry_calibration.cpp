#include "xray_registration/registration/geometry_calibration.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "registration/cause_selection.h"

namespace xray_registration {
namespace {

/// Coarse levels bring the hypothesis near, so that the fine ones see few pixels of error.
constexpr int kCoarsestLevel = 2;
constexpr int kCoarseSteps = 15;
constexpr int kFineSteps = 12;
/// σ from which a distortion is no accident.
constexpr double kCertain = 5.0;
/// A step from a compromise sees a part of a distortion: so much of what matters is enough to try.
constexpr double kPartSeen = 0.5;

std::vector<Stage> stagesFor(const JointFrames& frames) {
  std::vector<Stage> stages;
  for (int level = std::min(kCoarsestLevel, frames.lastLevel()); level >= 0; --level) {
    stages.push_back(stageOn(level, level == 0 ? kFineSteps : kCoarseSteps, Similarity::kLocalNormalised));
  }
  return stages;
}

/// The same without distortion, or with it alone.
CalibratedGroups groupsOf(const CalibratedGroups& groups, bool distortion) {
  CalibratedGroups some;
  std::copy_if(groups.begin(), groups.end(), std::back_inserter(some),
               [=](const CalibratedGroup& group) { return (group.what == kDistortion) == distortion; });
  return some;
}

/// Images are made anew from stage to stage, so that they are cropped and weighed as seen from the better hypothesis.
/// Distortion bends little, and comes last.
JointSolution descend(JointFrames* frames, const CalibratedGroups& groups, const JointSetup& start) {
  const std::size_t views = start.views.size();
  const FreeParameters straight(views, groupsOf(groups, false));
  JointSolution solution;
  solution.setup = start;
  for (const Stage& stage : stagesFor(*frames)) {
    frames->make(solution.setup);
    solution = solveJointly(frames, stage, straight, solution.setup);
  }
  const FreeParameters free(views, groups);
  if (free.bends()) solution = solveJointly(frames, stagesFor(*frames).back(), free, solution.setup);
  return solution;
}

/// Whether the bodies go on where the CT ends is not known: what matches better tells, as in a cold start.
bool leavesOutBetter(JointFrames* frames, const JointSetup& told) {
  double similarity[2];
  for (const bool leave_out : {false, true}) {
    frames->leaveOutUnexplained(leave_out);
    frames->make(told);
    const Stage stage = stagesFor(*frames).front();
    const FreeParameters nothing(told.views.size(), {});
    similarity[leave_out ? 1 : 0] = similarityOf(solveJointly(frames, stage, nothing, told).evidence);
  }
  return similarity[1] >= similarity[0];
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

/// The group whose σ exceeds its limits by the largest factor; the number of groups when none does.
std::size_t leastDetermined(const FreeParameters& free, const Eigen::MatrixXd& covariance) {
  std::size_t least = free.groups().size();
  double most = 1.0;
  for (std::size_t i = 0; i < free.groups().size(); ++i) {
    const double excess = excessOf(free, i, covariance);
    if (excess <= most) continue;
    most = excess;
    least = i;
  }
  return least;
}

/// Those of the groups that the frames determine together.
CalibratedGroups determinedOf(const JointFrames& frames, const JointSolution& solution, CalibratedGroups groups) {
  while (!groups.empty()) {
    const FreeParameters free(solution.setup.views.size(), groups);
    const Score score = jointScore(frames, solution, free);
    if (score.empty()) return {};
    const std::size_t least = leastDetermined(free, jointCovariance(score));
    if (least == groups.size()) break;
    groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(least));
  }
  return groups;
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
  for (int i = 0; i < 3; ++i) at_source.col(3 + i) = Eigen::Vector3d::Unit(i).cross(-centre_view_mm);
  sigma->source_mm = lengthSigma(at_source * covariance * at_source.transpose());
}

/// What is known of one group of one view: from the solution, or, where it was not freed, from what freeing it as well
/// would do.
struct GroupKnowledge {
  Eigen::MatrixXd covariance;
  Eigen::VectorXd estimate;  ///< One step from the solution.
  bool determined = false;
};

GroupKnowledge knowledgeOf(const JointFrames& frames, const JointSolution& solution, CalibratedGroups groups,
                           const CalibratedGroup& asked) {
  auto place = std::find_if(groups.begin(), groups.end(), [&](const CalibratedGroup& group) {
    return group.what == asked.what && group.isOf(asked.views.front());
  });
  if (place == groups.end()) place = groups.insert(groups.end(), asked);
  const auto index = static_cast<std::size_t>(place - groups.begin());
  const FreeParameters free(solution.setup.views.size(), groups);
  const Score score = jointScore(frames, solution, free);
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

/// Whether distortion may bend more than does not matter, as one step from a solution without sees it.
bool perhapsBent(const JointFrames& frames, const JointSolution& solution, const CalibratedGroups& groups,
                 const CalibratedGroup& distortion) {
  const GroupKnowledge known = knowledgeOf(frames, solution, groups, distortion);
  return known.determined && std::abs(known.estimate[0]) > kPartSeen * distortion.limits[0];
}

/// Whether a distortion that was solved for is there for certain, and bends more than does not matter.
bool isBent(const JointFrames& frames, const JointSolution& solution, const CalibratedGroups& groups,
            const CalibratedGroup& distortion) {
  const double bend = std::abs(solution.setup.views[distortion.views.front()].radial);
  const GroupKnowledge known = knowledgeOf(frames, solution, groups, distortion);
  return known.determined && bend > distortion.limits[0] && bend > kCertain * std::sqrt(known.covariance(0, 0));
}

/// Frees distortion as well when it is seen, the same of all views, which one device took; else everything stays as it
/// is.
void bend(JointFrames* frames, const CalibratedGroups& single, const JointSetup& as_told, CalibratedGroups* groups,
          JointSolution* solution) {
  const CalibratedGroup distortion = commonOf(groupsOf(single, true));
  if (!perhapsBent(*frames, *solution, *groups, distortion)) return;
  CalibratedGroups with = *groups;
  with.push_back(distortion);
  JointSolution found = descend(frames, with, as_told);
  if (!isBent(*frames, found, with, distortion)) return;
  *groups = std::move(with);
  *solution = std::move(found);
}

std::vector<CalibratedView> viewsOf(const JointFrames& frames, const JointSolution& solution,
                                    const CalibratedGroups& groups, const CalibratedGroups& single) {
  std::vector<CalibratedView> views;
  for (const ViewGeometry& geometry : solution.setup.views) views.push_back({geometry, {}, {}});
  const Eigen::Vector3d centre = meanCentre(solution.setup, frames.centreCt());
  for (const CalibratedGroup& group : single) {
    CalibratedView& view = views[group.views.front()];
    const GroupKnowledge known = knowledgeOf(frames, solution, groups, group);
    if (known.determined) {
      addSigma(group, known.covariance, view.geometry.T_view_first * centre, &view.sigma);
    } else {
      view.undetermined.push_back(group.what);
    }
  }
  return views;
}

}  // namespace

bool CalibratedView::isDetermined(const std::string& what) const {
  return std::find(undetermined.begin(), undetermined.end(), what) == undetermined.end();
}

GeometryCalibration calibrateGeometry(Engine* engine, const MakeCalibrationViews& make_views,
                                      const std::vector<RigidTransform>& T_camera_ct,
                                      const std::vector<ViewGeometry>& told, const CalibrationLimits& limits,
                                      const std::function<void()>& progress) {
  if (T_camera_ct.empty() || told.empty()) throw std::invalid_argument("a calibration needs frames and views");
  JointFrames frames(engine, make_views, progress);
  const JointSetup start{told, T_camera_ct};
  frames.leaveOutUnexplained(leavesOutBetter(&frames, start));
  frames.make(start);

  GeometryCalibration result;
  const FreeParameters nothing(told.size(), {});
  const JointSolution as_told =
      solveJointly(&frames, stageOn(0, kFineSteps, Similarity::kLocalNormalised), nothing, start);
  result.similarity_before = similarityOf(as_told.evidence);
  result.before = frames.residualMotion(as_told.setup);

  const CalibratedGroups single = calibratedGroups(frames, as_told.setup, limits);
  CalibratedGroups groups = selectCauses(&frames, single, as_told.setup);
  JointSolution solution = descend(&frames, groups, as_told.setup);
  for (;;) {
    const CalibratedGroups determined = determinedOf(frames, solution, groups);
    if (determined.size() == groups.size()) break;
    groups = determined;
    // What is held is held at what was told, so everything starts from there again.
    solution = descend(&frames, groups, as_told.setup);
  }
  bend(&frames, single, as_told.setup, &groups, &solution);
  result.views = viewsOf(frames, solution, groups, single);
  result.T_camera_ct = solution.setup.T_camera_ct;
  result.similarity_after = similarityOf(solution.evidence);
  result.converged = solution.converged;
  frames.make(solution.setup);
  result.after = frames.residualMotion(solution.setup);
  return result;
}

}  // namespace xray_registration

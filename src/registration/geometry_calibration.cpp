#include "xray_registration/registration/geometry_calibration.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "registration/calibration_knowledge.h"
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

/// Solves for those of the groups that the frames determine.
JointSolution solveDetermined(JointFrames* frames, const JointSetup& as_told, CalibratedGroups* groups) {
  JointSolution solution = descend(frames, *groups, as_told);
  for (;;) {
    CalibratedGroups determined = CalibrationKnowledge(frames, solution).determinedOf(*groups, as_told);
    if (determined.size() == groups->size()) return solution;
    *groups = std::move(determined);
    // What is held is held at what was told, so everything starts from there again.
    solution = descend(frames, *groups, as_told);
  }
}

/// Whether distortion may bend more than does not matter, as one step from a solution without sees it.
bool perhapsBent(JointFrames* frames, const JointSolution& solution, const CalibratedGroups& groups,
                 const CalibratedGroup& distortion) {
  const GroupKnowledge known = CalibrationKnowledge(frames, solution).of(groups, distortion);
  return known.determined && std::abs(known.estimate[0]) > kPartSeen * distortion.limits[0];
}

/// Whether a distortion that was solved for is there for certain, and bends more than does not matter.
bool isBent(JointFrames* frames, const JointSolution& solution, const CalibratedGroups& groups,
            const CalibratedGroup& distortion) {
  const double bend = std::abs(solution.setup.views[distortion.views.front()].radial);
  const GroupKnowledge known = CalibrationKnowledge(frames, solution).of(groups, distortion);
  return known.determined && bend > distortion.limits[0] && bend > kCertain * std::sqrt(known.covariance(0, 0));
}

/// Frees distortion as well when it is seen, the same of all views, which one device took; else everything stays as it
/// is.
void bend(JointFrames* frames, const CalibratedGroups& single, const JointSetup& as_told, CalibratedGroups* groups,
          JointSolution* solution) {
  const CalibratedGroup distortion = commonOf(groupsOf(single, true));
  if (!perhapsBent(frames, *solution, *groups, distortion)) return;
  CalibratedGroups with = *groups;
  with.push_back(distortion);
  // What imitated the distortion is not needed any more.
  JointSolution found = solveDetermined(frames, as_told, &with);
  if (!isBent(frames, found, with, distortion)) return;
  *groups = std::move(with);
  *solution = std::move(found);
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
  JointSolution solution = solveDetermined(&frames, as_told.setup, &groups);
  bend(&frames, single, as_told.setup, &groups, &solution);
  result.views = CalibrationKnowledge(&frames, solution).viewsOf(groups, single);
  result.T_camera_ct = solution.setup.T_camera_ct;
  result.similarity_after = similarityOf(solution.evidence);
  result.converged = solution.converged;
  frames.make(solution.setup);
  result.after = frames.residualMotion(solution.setup);
  return result;
}

}  // namespace xray_registration

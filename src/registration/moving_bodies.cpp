#include "registration/moving_bodies.h"

#include <algorithm>
#include <utility>

#include "registration/body_evidence.h"
#include "registration/body_judgement.h"
#include "registration/cold_start.h"
#include "registration/tracked_frame.h"

namespace xray_registration {
namespace {

/// Steps of the rest among its bodies, on the finest level: it is nearly there.
constexpr int kRestSteps = 4;
/// Of a body that is solved once more.
constexpr int kAgainSteps = 4;
/// How far a tracked body may be from its prediction, mm at its border.
constexpr double kTrackedMarginMm = 6.0;
/// Around a body where the whole CT is judged without it: it may have moved a little more.
constexpr double kLeftOutMarginMm = 3.0;
/// A body's volume, as the rest's, projected: windows beyond its shadow say nothing about it.
constexpr double kWindowMarginMm = 4.0;

std::vector<Eigen::Vector3d> cornersOf(const VolumeGrid& grid) {
  std::vector<Eigen::Vector3d> corners;
  const Eigen::Vector3d last = (grid.size - Eigen::Vector3i::Ones()).cast<double>();
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d which(i & 1, (i >> 1) & 1, (i >> 2) & 1);
    corners.emplace_back(grid.ctFromIndex() * which.cwiseProduct(last).eval());
  }
  return corners;
}

RegistrarOptions optionsFor(const BodyModel& model, RegistrarOptions options) {
  options.search_rotation_rad = model.max_rotation_rad;
  options.search_translation_mm = model.max_translation_mm;
  // What goes on beyond a cut face is the rest's business.
  options.truncation_weights = false;
  return options;
}

}  // namespace

MovingBodies::MovingBodies(Engine* whole, const AttenuationVolume& rest, const std::vector<BodyModel>& models)
    : rest_engine_(whole->sibling()) {
  rest_engine_->setVolume(rest);
  rest_views_ = std::make_unique<DeviceViews>(rest_engine_.get());
  for (const BodyModel& model : models) {
    Body body;
    body.model.name = model.name;
    body.model.max_rotation_rad = model.max_rotation_rad;
    body.model.max_translation_mm = model.max_translation_mm;
    body.corners_ct_mm = cornersOf(model.volume.grid);
    body.engine = whole->sibling();
    body.engine->setVolume(model.volume);
    body.views = std::make_unique<DeviceViews>(body.engine.get());
    bodies_.push_back(std::move(body));
  }
}

void MovingBodies::forget() {
  for (Body& body : bodies_) {
    body.T_ct_body.setIdentity();
    body.found.reset();
  }
}

void MovingBodies::leaveOutOf(DeviceViews* whole, const RigidTransform& T_camera_ct) const {
  std::vector<BodyPlace> places;
  for (const Body& body : bodies_) {
    places.push_back({body.corners_ct_mm, T_camera_ct});
    if (body.found) places.push_back({body.corners_ct_mm, T_camera_ct * body.T_ct_body});
  }
  whole->leaveOut(places, kLeftOutMarginMm);
}

std::vector<Surrounding> MovingBodies::around(const Body* body, const RigidTransform& T_camera_ct,
                                              const std::vector<RigidTransform>& T_ct_body) const {
  std::vector<Surrounding> others;
  if (body != nullptr) others.push_back({rest_engine_.get(), T_camera_ct});
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (&bodies_[i] != body) others.push_back({bodies_[i].engine.get(), T_camera_ct * T_ct_body[i]});
  }
  return others;
}

DeviceViews* MovingBodies::viewsOfRest(const DeviceViews& whole, const RigidTransform& T_camera_ct) {
  std::vector<RigidTransform> last;
  for (const Body& body : bodies_) last.push_back(body.T_ct_body);
  rest_views_->shareFrom(whole);
  rest_views_->surroundBy(around(nullptr, T_camera_ct, last));
  return rest_views_.get();
}

Solution MovingBodies::solve(Body* body, const BodyStart& start, const RigidTransform& T_camera_start,
                             const RegistrarOptions& options, StepBudget* budget) {
  const double radius_mm = body->engine->volume().radiusMm();
  const bool tracked = start.tracking && body->found;
  const double reach_mm =
      tracked ? kTrackedMarginMm : body->model.max_translation_mm + radius_mm * body->model.max_rotation_rad;
  body->views->limitTo(body->corners_ct_mm, T_camera_start, reach_mm + kWindowMarginMm);
  FrameObjective objective(body->engine.get(), body->views.get(), options, budget);
  if (tracked) return trackFrame(&objective, *body->found, T_camera_start);
  const ColdStartResult cold = startCold(&objective, T_camera_start);
  body->found = cold.found;
  return cold.solution;
}

void MovingBodies::refineRest(const DeviceViews& views, const std::vector<RigidTransform>& T_ct_body,
                              const RegistrarOptions& options, Solution* rest) {
  rest_views_->shareFrom(views);
  rest_views_->surroundBy(around(nullptr, rest->T_camera_ct, T_ct_body));
  StepBudget budget(options.max_steps_per_frame);
  FrameObjective objective(rest_engine_.get(), rest_views_.get(), options, &budget);
  Solution refined = *rest;
  if (objective.solve(stageOn(0, kRestSteps, options.similarity), &refined) && !refined.failed) *rest = refined;
}

std::vector<BodyResult> MovingBodies::registerIn(const DeviceViews& views, const std::vector<BodyStart>& starts,
                                                 const RegistrarOptions& options, Solution* rest) {
  std::vector<RigidTransform> T_ct_body;
  bool cold = false;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    T_ct_body.push_back(i < starts.size() ? starts[i].T_ct_body : RigidTransform::Identity());
    cold |= !(i < starts.size() && starts[i].tracking && bodies_[i].found);
  }
  std::vector<BodyResult> results(bodies_.size());
  const int sweeps = cold ? 2 : 1;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      Body& body = bodies_[i];
      StepBudget budget(options.max_steps_per_frame);
      const RegistrarOptions own = optionsFor(body.model, options);
      body.views->shareFrom(views);
      const RigidTransform T_camera_start = rest->T_camera_ct * T_ct_body[i];
      const BodyStart start = i < starts.size() ? starts[i] : BodyStart();
      if (sweep == 0) {
        body.views->surroundBy(around(&body, rest->T_camera_ct, T_ct_body));
      }
      Solution solution;
      if (sweep == 0) {
        solution = solve(&body, start, T_camera_start, own, &budget);
      } else {
        body.views->limitTo(body.corners_ct_mm, T_camera_start, kTrackedMarginMm + kWindowMarginMm);
        body.views->surroundBy(around(&body, rest->T_camera_ct, T_ct_body));
        FrameObjective objective(body.engine.get(), body.views.get(), own, &budget);
        solution.T_camera_ct = T_camera_start;
        solution.robust_scale2 = body.found->robust_scale2;
        objective.solve(stageOn(0, kAgainSteps, own.similarity), &solution);
      }
      BodyCues cues;
      cues.solution = solution;
      cues.T_camera_ct = rest->T_camera_ct;
      cues.evidence = evidenceFor(body.engine.get(), body.views.get(), solution.T_camera_ct, {0, 2, 1});
      cues.exceeded_steps = budget.exceeded() ? budget.allowed() : 0;
      const int before = results[i].iterations;
      results[i] = judgeBody(*body.views, body.model, cues, own);
      results[i].iterations = before + budget.used();
      if (!solution.failed && results[i].solved) T_ct_body[i] = rest->T_camera_ct.inverse() * solution.T_camera_ct;
    }
    if (cold && sweep + 1 < sweeps) refineRest(views, T_ct_body, options, rest);
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (results[i].accepted) bodies_[i].T_ct_body = T_ct_body[i];
    if (!results[i].accepted) bodies_[i].found.reset();
  }
  return results;
}

}  // namespace xray_registration

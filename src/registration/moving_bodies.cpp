#include "registration/moving_bodies.h"

#include <algorithm>
#include <utility>

#include "registration/body_search.h"

namespace xray_registration {
namespace {

/// Steps of the rest among its bodies, on the finest level: it is nearly there.
constexpr int kRestSteps = 4;
/// Above soft tissue, which stays with the rest (SolidBody).
constexpr double kBonePerMm = 0.002;
/// How far a tracked body may be from its prediction, mm at its border.
constexpr double kTrackedMarginMm = 4.0;
/// Around a body where the whole CT is judged without it: it may have moved a little more.
constexpr double kLeftOutMarginMm = 3.0;
/// A body's volume, as the rest's, projected: windows beyond its shadow say nothing about it.
constexpr double kWindowMarginMm = 2.0;

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
    body.solid = std::make_shared<const SolidBody>(model.volume, kBonePerMm);
    body.engine = whole->sibling();
    body.engine->setVolume(model.volume);
    body.views = std::make_unique<DeviceViews>(body.engine.get());
    bodies_.push_back(std::move(body));
  }
}

void MovingBodies::forget() {
  for (Body& body : bodies_) {
    body.T_ct_body.setIdentity();
    body.found = false;
  }
}

std::vector<FloatImage> MovingBodies::render(const XrayCamera& camera, const RigidTransform& T_camera_ct,
                                             const std::vector<RigidTransform>& T_camera_bodies) const {
  std::vector<FloatImage> parts = {rest_engine_->render(camera, 0, T_camera_ct)};
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    parts.push_back(bodies_[i].engine->render(camera, 0, T_camera_bodies.at(i)));
  }
  return parts;
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

void MovingBodies::look(const DeviceViews& views, Body* body, const RigidTransform& T_camera_start, double reach_mm,
                        const RigidTransform& T_camera_ct, const std::vector<RigidTransform>& T_ct_body) {
  body->views->shareFrom(views);
  body->views->limitTo(body->corners_ct_mm, T_camera_start, reach_mm + kWindowMarginMm);
  body->views->surroundBy(around(body, T_camera_ct, T_ct_body));
}

BodyCues MovingBodies::solve(Body* body, const BodyStart& start, const RigidTransform& T_camera_ct,
                             BodyObjective* objective) {
  BodyCues cues;
  const RigidTransform T_camera_start = T_camera_ct * start.T_ct_body;
  if (start.tracking && body->found) {
    cues.solution = trackBody(objective, T_camera_start);
  } else {
    const BodySolution found = searchBody(objective, T_camera_ct, T_camera_start);
    cues.solution = found.solution;
    cues.rival = found.rival;
  }
  return cues;
}

Eigen::MatrixXd MovingBodies::overlapsMm3(const std::vector<RigidTransform>& T_ct_body) const {
  const auto count = static_cast<Eigen::Index>(bodies_.size());
  Eigen::MatrixXd overlaps = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = i + 1; j < count; ++j) {
      const auto a = static_cast<std::size_t>(i);
      const auto b = static_cast<std::size_t>(j);
      overlaps(i, j) = overlaps(j, i) =
          overlapMm3(*bodies_[a].solid, *bodies_[b].solid, T_ct_body[a].inverse() * T_ct_body[b]);
    }
  }
  return overlaps;
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
    T_ct_body.push_back(starts.at(i).T_ct_body);
    cold |= !(starts[i].tracking && bodies_[i].found);
  }
  std::vector<BodyCues> cues(bodies_.size());
  std::vector<StepBudget> budgets(bodies_.size(), StepBudget(options.max_steps_per_frame));
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    const RegistrarOptions own = optionsFor(body.model, options);
    const bool tracked = starts[i].tracking && body.found;
    const double reach_mm =
        tracked ? kTrackedMarginMm
                : body.model.max_translation_mm + body.engine->volume().radiusMm() * body.model.max_rotation_rad;
    look(views, &body, rest->T_camera_ct * (tracked ? T_ct_body[i] : RigidTransform::Identity()), reach_mm,
         rest->T_camera_ct, T_ct_body);
    BodyObjective objective(body.engine.get(), body.views.get(), own, &budgets[i]);
    cues[i] = solve(&body, starts[i], rest->T_camera_ct, &objective);
    if (!cues[i].solution.failed) T_ct_body[i] = rest->T_camera_ct.inverse() * cues[i].solution.T_camera_ct;
  }
  if (cold) {
    refineRest(views, T_ct_body, options, rest);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      Body& body = bodies_[i];
      if (cues[i].solution.failed) continue;
      const RegistrarOptions own = optionsFor(body.model, options);
      look(views, &body, cues[i].solution.T_camera_ct, kTrackedMarginMm, rest->T_camera_ct, T_ct_body);
      BodyObjective objective(body.engine.get(), body.views.get(), own, &budgets[i]);
      const Solution refined = refineBody(&objective, cues[i].solution.T_camera_ct);
      if (!refined.failed) cues[i].solution = refined;
      T_ct_body[i] = rest->T_camera_ct.inverse() * cues[i].solution.T_camera_ct;
    }
  }
  std::vector<BodyResult> results;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    cues[i].T_camera_ct = rest->T_camera_ct;
    cues[i].exceeded_steps = budgets[i].exceeded() ? budgets[i].allowed() : 0;
    results.push_back(judgeBody(*body.views, body.model, cues[i], options));
    results.back().iterations = budgets[i].used();
  }
  refuseOverlaps(overlapsMm3(T_ct_body), options.accept.body, &results);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].found = results[i].accepted;
    if (bodies_[i].found) bodies_[i].T_ct_body = T_ct_body[i];
  }
  return results;
}

}  // namespace xray_registration

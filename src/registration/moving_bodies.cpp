#include "registration/moving_bodies.h"

#include <algorithm>
#include <limits>
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
constexpr double kMisleadingMm = 5.0;
constexpr std::size_t kNoBody = std::numeric_limits<std::size_t>::max();

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
  backdrop_ = std::make_unique<DeviceViews>(rest_engine_.get());
  for (const BodyModel& model : models) {
    Body body;
    body.model.name = model.name;
    body.model.max_rotation_rad = model.max_rotation_rad;
    body.model.max_translation_mm = model.max_translation_mm;
    body.solid = std::make_shared<const SolidBody>(model.volume, kBonePerMm);
    body.engine = whole->sibling();
    body.engine->setVolume(model.volume);
    body.corners_ct_mm = body.engine->volume().cornersCt();
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
    places.push_back({body.corners_ct_mm, T_camera_ct, kLeftOutMarginMm});
    if (body.found) places.push_back({body.corners_ct_mm, T_camera_ct * body.T_ct_body, kLeftOutMarginMm});
  }
  whole->leaveOut(places);
}

std::vector<Surrounding> MovingBodies::othersThan(std::size_t body, const RigidTransform& T_camera_ct,
                                                  const std::vector<RigidTransform>& T_ct_body) const {
  std::vector<Surrounding> others;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (i != body) others.push_back({bodies_[i].engine.get(), T_camera_ct * T_ct_body[i]});
  }
  return others;
}

DeviceViews* MovingBodies::viewsOfRest(const DeviceViews& whole, const RigidTransform& T_camera_ct) {
  std::vector<RigidTransform> last;
  last.reserve(bodies_.size());
  for (const Body& body : bodies_) last.push_back(body.T_ct_body);
  rest_views_->shareFrom(whole);
  rest_views_->surroundBy(othersThan(kNoBody, T_camera_ct, last));
  return rest_views_.get();
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

double MovingBodies::farthestMm(const std::vector<RigidTransform>& T_ct_body,
                                const std::vector<RigidTransform>& T_ct_before) const {
  double farthest_mm = 0.0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Eigen::Vector3d& centre_ct_mm = bodies_[i].engine->volume().centreCt();
    farthest_mm = std::max(farthest_mm, (T_ct_body[i] * centre_ct_mm - T_ct_before[i] * centre_ct_mm).norm());
  }
  return farthest_mm;
}

bool MovingBodies::isTracked(const Frame& frame, std::size_t body) const {
  return frame.starts[body].tracking && bodies_[body].found;
}

BodyPlace MovingBodies::expected(const Frame& frame, std::size_t i) const {
  const Body& body = bodies_[i];
  if (isTracked(frame, i)) return found(frame, i);
  const double reach_mm =
      body.model.max_translation_mm + body.engine->volume().radiusMm() * body.model.max_rotation_rad;
  return {body.corners_ct_mm, frame.rest->T_camera_ct, reach_mm + kWindowMarginMm};
}

BodyPlace MovingBodies::found(const Frame& frame, std::size_t body) const {
  return {bodies_[body].corners_ct_mm, frame.rest->T_camera_ct * frame.T_ct_body[body],
          kTrackedMarginMm + kWindowMarginMm};
}

void MovingBodies::drawBackdrop(const Frame& frame, const std::vector<BodyPlace>& places) {
  backdrop_->shareFrom(frame.views);
  backdrop_->limitTo(places);
  backdrop_->surroundBy({{rest_engine_.get(), frame.rest->T_camera_ct}});
}

void MovingBodies::solveEach(Frame* frame, const std::vector<BodyPlace>& places,
                             const std::function<void(std::size_t body, BodyObjective*)>& solve) {
  drawBackdrop(*frame, places);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    body.views->shareFrom(frame->views);
    body.views->limitTo({places[i]});
    body.views->surroundBy(othersThan(i, frame->rest->T_camera_ct, frame->T_ct_body), backdrop_.get());
    const RegistrarOptions own = optionsFor(body.model, frame->options);
    BodyObjective objective(body.engine.get(), body.views.get(), own, &frame->budgets[i], frame->rest->T_camera_ct,
                            body.model);
    solve(i, &objective);
    const Solution& solution = frame->cues[i].solution;
    if (!solution.failed) frame->T_ct_body[i] = frame->rest->T_camera_ct.inverse() * solution.T_camera_ct;
  }
}

void MovingBodies::search(Frame* frame, std::size_t body, BodyObjective* objective) {
  const RigidTransform T_camera_start = frame->rest->T_camera_ct * frame->T_ct_body[body];
  BodyCues& cues = frame->cues[body];
  if (isTracked(*frame, body)) {
    cues.solution = trackBody(objective, T_camera_start);
    return;
  }
  const BodySolution best = searchBody(objective, frame->rest->T_camera_ct, T_camera_start);
  cues.solution = best.solution;
  cues.rival = best.rival;
}

void MovingBodies::refine(Frame* frame, std::size_t body, BodyObjective* objective) {
  BodyCues& cues = frame->cues[body];
  if (cues.solution.failed) return;
  const Solution refined = refineBody(objective, cues.solution.T_camera_ct);
  if (!refined.failed) cues.solution = refined;
  cues.views = objective->similarityOfViews(bodyStage(0, 1), cues.solution.T_camera_ct);
}

void MovingBodies::refineRest(Frame* frame) {
  rest_views_->shareFrom(frame->views);
  rest_views_->surroundBy(othersThan(kNoBody, frame->rest->T_camera_ct, frame->T_ct_body));
  StepBudget budget(frame->options.max_steps_per_frame);
  FrameObjective objective(rest_engine_.get(), rest_views_.get(), frame->options, &budget);
  Solution refined = *frame->rest;
  if (objective.solve(stageOn(0, kRestSteps, frame->options.similarity), &refined) && !refined.failed) {
    *frame->rest = refined;
  }
}

std::vector<BodyResult> MovingBodies::judge(const Frame& frame) {
  std::vector<BodyResult> results;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    BodyCues cues = frame.cues[i];
    cues.T_camera_ct = frame.rest->T_camera_ct;
    cues.exceeded_steps = frame.budgets[i].exceeded() ? frame.budgets[i].allowed() : 0;
    results.push_back(judgeBody(*bodies_[i].views, bodies_[i].model, cues, frame.options));
    results.back().iterations = frame.budgets[i].used();
  }
  refuseOverlaps(overlapsMm3(frame.T_ct_body), frame.options.accept.body, &results);
  return results;
}

std::vector<BodyResult> MovingBodies::registerIn(const DeviceViews& views, const std::vector<BodyStart>& starts,
                                                 const RegistrarOptions& options, Solution* rest) {
  const std::size_t count = bodies_.size();
  Frame frame{views, options, rest, starts, {}, std::vector<BodyCues>(count), {}};
  frame.budgets.assign(count, StepBudget(options.max_steps_per_frame));
  for (std::size_t i = 0; i < count; ++i) frame.T_ct_body.push_back(starts.at(i).T_ct_body);
  const std::vector<RigidTransform> drawn = frame.T_ct_body;
  std::vector<BodyPlace> places;
  bool cold = false;
  for (std::size_t i = 0; i < count; ++i) {
    places.push_back(expected(frame, i));
    cold |= !isTracked(frame, i);
  }
  solveEach(&frame, places, [&](std::size_t i, BodyObjective* objective) { search(&frame, i, objective); });
  if (cold) {
    refineRest(&frame);
    // A body that was drawn elsewhere than it is has misled the search for the others.
    if (farthestMm(frame.T_ct_body, drawn) > kMisleadingMm) {
      solveEach(&frame, places, [&](std::size_t i, BodyObjective* objective) { search(&frame, i, objective); });
    }
    for (std::size_t i = 0; i < count; ++i) places[i] = found(frame, i);
    solveEach(&frame, places, [&](std::size_t i, BodyObjective* objective) { refine(&frame, i, objective); });
  }
  const std::vector<BodyResult> results = judge(frame);
  for (std::size_t i = 0; i < count; ++i) {
    bodies_[i].found = results[i].accepted;
    if (bodies_[i].found) bodies_[i].T_ct_body = frame.T_ct_body[i];
  }
  return results;
}

}  // namespace xray_registration

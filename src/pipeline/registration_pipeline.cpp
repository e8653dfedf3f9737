#include "xray_registration/pipeline/registration_pipeline.h"

#include <algorithm>
#include <new>
#include <utility>

#include "pipeline/body_volumes.h"
#include "pipeline/checked_registrar.h"
#include "pipeline/failure_text.h"
#include "pipeline/pipeline_search.h"
#include "pipeline/present_views.h"
#include "xray_registration/common/stopwatch.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/pipeline/start_check.h"
#include "xray_registration/registration/fast_registrar.h"
#include "xray_registration/volume/volume_error.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {
namespace {

RegistrationResult refusedBecause(const std::string& reason) {
  RegistrationResult result;
  result.reason = reason;
  return result;
}

/// A body that is a mesh is metal, which must not be masked away; other metal then is not either.
ImageParameters imageFor(const NodeParameters& parameters, const Logger& logger) {
  ImageParameters image = parameters.image;
  const bool has_mesh = std::any_of(parameters.bodies.begin(), parameters.bodies.end(),
                                    [](const BodyParameters& body) { return !body.mesh.empty(); });
  if (has_mesh && image.find.metal) {
    image.find.metal = false;
    log(logger, LogLevel::kInfo, "a body is a mesh: metal is not looked for and masked (image/find_metal)");
  }
  return image;
}

/// What a body with a CT of its own gave in a frame.
BodyResult asBody(const std::string& name, const RegistrationResult& result, const Eigen::Vector3d& centre_mm) {
  BodyResult body;
  body.name = name;
  body.T_camera_body = result.T_camera_ct;
  body.solved = result.solved;
  body.accepted = result.accepted;
  body.reason = result.reason;
  body.similarity = result.similarity;
  body.inlier_fraction = result.inlier_fraction;
  body.iterations = result.iterations;
  body.centre_ct_mm = centre_mm;
  body.covariance = result.covariance;
  return body;
}

/// ct/label without a list of bodies: the frame's result is that structure's. The covariance goes on being about the
/// CT's centre, which is what everybody takes it for.
void takeOnlyBody(const Eigen::Vector3d& centre_ct_mm, RegistrationResult* result) {
  if (!result->accepted || result->bodies.size() != 1 || result->bodies.front().name != kOnlyBody) return;
  const BodyResult only = result->bodies.front();
  result->bodies.clear();
  result->T_camera_ct = only.T_camera_body;
  result->accepted = only.accepted;
  result->reason = only.reason;
  result->similarity = only.similarity;
  result->inlier_fraction = only.inlier_fraction;
  const Matrix6d carried = twistMovedBy(only.T_camera_body.linear() * (centre_ct_mm - only.centre_ct_mm));
  result->covariance = carried * only.covariance * carried.transpose();
}

}  // namespace

RegistrationPipeline::RegistrationPipeline(NodeParameters parameters, DeviceHost device, Logger logger)
    : parameters_(std::move(parameters)),
      logger_(std::move(logger)),
      frame_maker_(imageFor(parameters_, logger_), parameters_.viewNames()),
      device_(std::move(device)),
      body_(parameters_.tracker) {}

RegistrationPipeline::RegistrationPipeline(const NodeParameters& parameters, const Logger& logger)
    : RegistrationPipeline(parameters, DeviceHost(parameters.device, parameters.registrar, logger), logger) {}

RegistrationPipeline::RegistrationPipeline(const NodeParameters& parameters, RegistrarFactory factory,
                                           const Logger& logger)
    : RegistrationPipeline(parameters, DeviceHost(std::move(factory), parameters.registrar, logger), logger) {}

void RegistrationPipeline::loadCt(const std::string& path, const std::string& series_uid) {
  VolumeReadOptions options = parameters_.ct.read;
  if (!series_uid.empty()) options.series_uid = series_uid;
  try {
    setCt(readVolume(path, options, logger_));
  } catch (const std::bad_alloc&) {
    throw VolumeError("'" + path + "': there is not enough memory for this CT");
  }
}

void RegistrationPipeline::setCt(Volume ct) {
  CtParts parts = partsOf(ct, parameters_, logger_);
  std::vector<RegisteredBody> own = bodiesOfTheirOwn(&ct, parameters_, logger_);
  auto shared_ct = std::make_shared<const Volume>(std::move(ct));
  // From here on the new CT counts, also when the device refuses it: an old one must not go on being registered.
  ct_ = std::move(shared_ct);
  body_.forgetPose();
  body_.attenuation = std::move(parts.whole);
  body_.rest = std::move(parts.rest);
  body_.bodies = std::move(parts.bodies);
  body_.name = ct_->name;
  // A body may have stood here.
  body_.range.reset();
  body_.T_camera_ct_configured.reset();
  first_is_body_ = !parameters_.ct.rest && !own.empty();
  upload(std::move(own));
}

void RegistrationPipeline::loadBodies() {
  if (parameters_.needsCt()) return;
  first_is_body_ = true;
  upload(bodiesOfTheirOwn(nullptr, parameters_, logger_));
}

void RegistrationPipeline::upload(std::vector<RegisteredBody> own) {
  dropSearch();
  own_.clear();
  if (first_is_body_) {
    // Nothing is known around the bodies: the first one stands for the CT.
    std::unique_ptr<Registrar> registrar = std::move(body_.registrar);
    body_ = std::move(own.front());
    body_.registrar = std::move(registrar);
    own.erase(own.begin());
  }
  device_.noteSuccess();
  device_.upload(&body_);
  own_ = std::move(own);
  for (RegisteredBody& body : own_) device_.upload(&body);
  startConfigured();
}

/// Bodies that are registered by themselves need no start of the CT when they have one.
void RegistrationPipeline::startConfigured() {
  if (first_is_body_ && body_.T_camera_ct_configured) body_.startFrom(*body_.T_camera_ct_configured);
  for (RegisteredBody& body : own_) {
    if (body.T_camera_ct_configured) body.startFrom(*body.T_camera_ct_configured);
  }
}

std::optional<RigidTransform> RegistrationPipeline::configuredStartOf(const std::string& body) const {
  for (const BodyParameters& parameters : parameters_.bodies) {
    if (parameters.name == body) return parameters.initial_pose;
  }
  return std::nullopt;
}

void RegistrationPipeline::setPose(const RigidTransform& T_camera_ct, const BodyPoses& T_camera_bodies) {
  dropSearch();
  std::vector<RigidTransform> T_ct_bodies;
  for (const BodyModel& body : body_.bodies) {
    const auto given = T_camera_bodies.find(body.name);
    const RigidTransform T_camera_body =
        given == T_camera_bodies.end() ? configuredStartOf(body.name).value_or(T_camera_ct) : given->second;
    T_ct_bodies.emplace_back(T_camera_ct.inverse() * T_camera_body);
  }
  body_.startFrom(T_camera_ct, T_ct_bodies);
  for (RegisteredBody& body : own_) {
    const auto given = T_camera_bodies.find(body.name);
    if (given != T_camera_bodies.end()) {
      body.startFrom(given->second);
    } else {
      body.startFrom(body.T_camera_ct_configured.value_or(T_camera_ct));
    }
  }
}

bool RegistrationPipeline::setBodyPose(const std::string& body, const RigidTransform& T_camera_body, double stamp_s) {
  if (first_is_body_ && body == body_.name) {
    body_.startFrom(T_camera_body);
    return true;
  }
  for (RegisteredBody& own : own_) {
    if (own.name != body) continue;
    own.startFrom(T_camera_body);
    return true;
  }
  const std::optional<RigidTransform> T_camera_ct = body_.tracker.prediction(stamp_s);
  for (std::size_t i = 0; T_camera_ct && i < body_.bodies.size(); ++i) {
    if (body_.bodies[i].name != body) continue;
    body_.tracker.setBodyPose(i, T_camera_ct->inverse() * T_camera_body);
    return true;
  }
  return false;
}

bool RegistrationPipeline::hasStart(double stamp_s) const {
  return body_.tracker.prediction(stamp_s) || std::any_of(own_.begin(), own_.end(), [&](const RegisteredBody& own) {
           return own.tracker.prediction(stamp_s).has_value();
         });
}

void RegistrationPipeline::reset() {
  dropSearch();
  body_.forgetPose();
  recovery_.note(true);
  for (RegisteredBody& body : own_) body.forgetPose();
  device_.forgetFault(&body_);
  if (!body_.registrar) closeOwn();
  startConfigured();
}

/// Everything that is on a device that failed goes, before it is opened anew.
bool RegistrationPipeline::rebuildAfter(const std::string& problem) {
  dropSearch();
  closeOwn();
  return device_.rebuildAfter(problem, &body_);
}

void RegistrationPipeline::closeOwn() {
  for (RegisteredBody& body : own_) body.registrar.reset();
}

std::vector<FollowedBodyInfo> RegistrationPipeline::followedBodies() const {
  std::vector<FollowedBodyInfo> bodies;
  for (const BodyModel& body : body_.bodies) {
    if (body.name != kOnlyBody) bodies.push_back({body.name, true, body.centre_ct_mm});
  }
  if (first_is_body_ && hasCt()) bodies.push_back({body_.name, false, body_.centre_ct_mm});
  for (const RegisteredBody& body : own_) bodies.push_back({body.name, false, body.centre_ct_mm});
  return bodies;
}

std::optional<VolumeGrid> RegistrationPipeline::ctGrid() const {
  if (!hasCt()) return std::nullopt;
  return body_.attenuation->grid;
}

TrackingState RegistrationPipeline::state() const {
  if (!fault().empty()) return TrackingState::kFault;
  if (!hasCt()) return TrackingState::kWaitingForCt;
  return body_.tracker.state();
}

void RegistrationPipeline::noteUnusable() {
  body_.tracker.noteUnusable();
  for (RegisteredBody& body : own_) body.tracker.noteUnusable();
}

void RegistrationPipeline::loseTrack() {
  body_.tracker.loseTrack();
  for (RegisteredBody& body : own_) body.tracker.loseTrack();
}

FrameOutcome RegistrationPipeline::process(double stamp_s, std::vector<RawView> views,
                                           const std::optional<RigidTransform>& T_camera_now_camera_last) {
  const Stopwatch watch;
  FrameOutcome outcome;
  try {
    outcome.result.reason = reasonToRefuse(stamp_s, std::move(views), &outcome);
  } catch (const std::bad_alloc&) {
    outcome.result.reason = "the frame was not looked at: out of memory";
  }
  const bool usable = outcome.result.reason.empty();
  if (!usable) noteUnusable();
  if (!usable || !registerOrRecover(stamp_s, T_camera_now_camera_last, &outcome)) {
    refuseBodies(outcome.result.reason, &outcome.result);
    refuseOwn(&outcome.result);
  }
  outcome.state = state();
  outcome.total_ms = watch.milliseconds();
  return outcome;
}

/// Registers a frame, or does what is done instead while the CT is LOST; then it is false, with the reason.
bool RegistrationPipeline::registerOrRecover(double stamp_s,
                                             const std::optional<RigidTransform>& T_camera_now_camera_last,
                                             FrameOutcome* outcome) {
  switch (recovery_.next(parameters_.recover, body_.tracker.state())) {
    case Recovery::Step::kWait:
      outcome->result.reason = "the CT is lost, and parameter tracking/recover is off: a new pose is needed";
      return false;
    case Recovery::Step::kSearch:
      return registerWhatIsFound(stamp_s, T_camera_now_camera_last, outcome);
    case Recovery::Step::kRegister:
      complete(stamp_s, T_camera_now_camera_last, {}, outcome);
  }
  recovery_.note(outcome->result.accepted);
  return true;
}

/// Registers a frame whose views are made, the CT and whatever goes with it.
void RegistrationPipeline::complete(double stamp_s, const std::optional<RigidTransform>& T_camera_now_camera_last,
                                    const std::vector<RigidTransform>& places, FrameOutcome* outcome) {
  const CameraMotion moved{body_.last_accepted_s, T_camera_now_camera_last};
  outcome->result = solve(stamp_s, *outcome, T_camera_now_camera_last, places);
  outcome->registered = outcome->result.solved;
  takeOnlyBody(body_.centre_ct_mm, &outcome->result);
  if (!outcome->result.accepted) {
    refuseBodies("the CT around it was not accepted: " + outcome->result.reason, &outcome->result);
  }
  solveOwn(stamp_s, outcome->views, moved, &outcome->result);
}

std::string RegistrationPipeline::viewsProblem(std::vector<RawView> views, FrameOutcome* outcome) {
  if (!fault().empty()) return fault();
  if (!hasCt()) return parameters_.needsCt() ? "no CT is loaded" : "no bodies are loaded";
  FrameViews frame = frame_maker_.make(std::move(views));
  outcome->prepare_ms = frame.prepare_ms;
  outcome->views = std::move(frame.views);
  outcome->views_used = std::move(frame.used);
  outcome->views_missing = std::move(frame.missing);
  outcome->missing_because = std::move(frame.problem);
  const bool enough = outcome->views_missing.empty() || parameters_.sync.allow_missing_view;
  if (outcome->views_used.empty() || !enough) return outcome->missing_because;
  return device_.isReady(&body_) ? "" : fault();
}

std::string RegistrationPipeline::reasonToRefuse(double stamp_s, std::vector<RawView> views, FrameOutcome* outcome) {
  std::string problem = viewsProblem(std::move(views), outcome);
  if (!problem.empty()) return problem;
  if (!hasStart(stamp_s)) return "no initial pose is known yet";
  problem = startProblem(stamp_s, *outcome);
  // A device that failed meanwhile was opened anew, or is the fault.
  return device_.isReady(&body_) ? problem : fault();
}

/// A start that cannot be right is not searched around.
std::string RegistrationPipeline::startProblem(double stamp_s, const FrameOutcome& frame) {
  const std::optional<RigidTransform> start = body_.tracker.prediction(stamp_s);
  if (!start || body_.tracker.state() != TrackingState::kWaitingForPose) return "";
  bool is_drawn = true;
  const auto render = [this, &is_drawn](const XrayCamera& camera, const RigidTransform& T) {
    FloatImage drr = renderDrr(camera, T);
    is_drawn = is_drawn && !drr.empty();
    return drr;
  };
  std::string problem;
  for (const ViewInput& view : presentViews(frame.views)) {
    const RigidTransform T_view_ct = view.T_view_first * *start;
    problem = impossibleStart(T_view_ct, body_.attenuation->grid, view.xray->camera);
    if (problem.empty()) problem = turnedStart(T_view_ct, body_.centre_ct_mm, view, render);
    if (!is_drawn) return "";        // A device that failed says nothing of the start.
    if (problem.empty()) return "";  // A view may look past the CT, or hardly see a turn.
  }
  return problem;
}

RegistrationResult RegistrationPipeline::solve(double stamp_s, const FrameOutcome& frame,
                                               const std::optional<RigidTransform>& T_camera_now_camera_last,
                                               const std::vector<RigidTransform>& places) {
  RegistrationResult result;
  try {
    CheckedRegistrar registrar(body_.registrar.get(), places);
    result = body_.tracker.process(&registrar, presentViews(frame.views), stamp_s, T_camera_now_camera_last);
  } catch (const DeviceError& error) {
    const bool rebuilt = rebuildAfter(error.what());
    return refusedBecause(std::string("the device failed: ") + error.what() + (rebuilt ? " (it was opened anew)" : ""));
  } catch (const std::exception& error) {
    return refusedBecause("the registration failed: " + inWords(error));
  }
  // Registrars promise finite poses; a broken promise must not reach tf.
  if (!result.T_camera_ct.matrix().allFinite())
    return refusedBecause("the registration gave a pose that is not finite");
  if (result.accepted) {
    body_.last_accepted_s = stamp_s;
    device_.noteSuccess();
    result.reason.clear();
  } else if (result.reason.empty()) {
    result.reason = "the registration was not accepted";
  }
  if (!result.accepted && !frame.missing_because.empty()) result.reason += " (" + frame.missing_because + ")";
  return result;
}

/// Bodies that are cut out of a CT that was not found: they are where it is, as far as anybody knows.
void RegistrationPipeline::refuseBodies(const std::string& reason, RegistrationResult* result) const {
  result->bodies.clear();
  for (const BodyModel& body : body_.bodies) {
    if (body.name == kOnlyBody) continue;
    BodyResult refused;
    refused.name = body.name;
    refused.T_camera_body = result->T_camera_ct;
    refused.reason = reason;
    refused.centre_ct_mm = body.centre_ct_mm;
    result->bodies.push_back(std::move(refused));
  }
}

void RegistrationPipeline::refuseOwn(RegistrationResult* result) const {
  const RegistrationResult refused = refusedBecause(result->reason);
  if (first_is_body_ && hasCt()) result->bodies.push_back(asBody(body_.name, refused, body_.centre_ct_mm));
  for (const RegisteredBody& body : own_) result->bodies.push_back(asBody(body.name, refused, body.centre_ct_mm));
}

void RegistrationPipeline::solveOwn(double stamp_s, const std::vector<std::optional<ViewInput>>& views,
                                    const CameraMotion& moved, RegistrationResult* result) {
  if (first_is_body_) result->bodies.push_back(asBody(body_.name, *result, body_.centre_ct_mm));
  for (RegisteredBody& body : own_) result->bodies.push_back(solveOwn(stamp_s, views, moved, &body));
}

BodyResult RegistrationPipeline::solveOwn(double stamp_s, const std::vector<std::optional<ViewInput>>& views,
                                          const CameraMotion& moved, RegisteredBody* body) {
  RegistrationResult result;
  if (!device_.isReady(body)) return asBody(body->name, refusedBecause(fault()), body->centre_ct_mm);
  try {
    CheckedRegistrar registrar(body->registrar.get());
    const bool seen_then = moved.since_s && body->last_accepted_s == moved.since_s;
    result = body->tracker.process(&registrar, presentViews(views), stamp_s,
                                   seen_then ? moved.T_camera_now_camera_last : std::nullopt);
  } catch (const DeviceError& error) {
    // The next frame opens the device anew.
    rebuildAfter(error.what());
    result = refusedBecause(std::string("the device failed: ") + error.what());
  } catch (const std::exception& error) {
    result = refusedBecause("the registration failed: " + inWords(error));
  }
  if (result.accepted) body->last_accepted_s = stamp_s;
  if (!result.accepted && result.reason.empty()) result.reason = "the registration was not accepted";
  return asBody(body->name, result, body->centre_ct_mm);
}

Engine* RegistrationPipeline::engine() {
  auto* fast = dynamic_cast<FastRegistrar*>(body_.registrar.get());
  return fast != nullptr && fast->hasVolume() ? &fast->engine() : nullptr;
}

void RegistrationPipeline::setTuning(const RegistrarOptions& registrar, const TrackerOptions& tracker) {
  const Method method = parameters_.registrar.method;
  parameters_.registrar = registrar;
  parameters_.registrar.method = method;
  parameters_.tracker = tracker;
  body_.tracker.setOptions(tracker);
  for (RegisteredBody& body : own_) body.tracker.setOptions(tracker);
  dropSearch();
  try {
    device_.setOptions(parameters_.registrar, &body_);
    for (RegisteredBody& body : own_) device_.setOptions(parameters_.registrar, &body);
  } catch (const DeviceError& error) {
    log(logger_, LogLevel::kError, std::string("the device failed after a change of parameters: ") + error.what());
  }
}

}  // namespace xray_registration

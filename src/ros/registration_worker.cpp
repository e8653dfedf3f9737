#include "xray_registration/ros/registration_worker.h"

#include <ros/init.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <utility>

#include "calibration_answer.h"
#include "held_views.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/image/straight_pixel.h"
#include "xray_registration/pipeline/frame_latency.h"
#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/result_transforms.h"
#include "xray_registration/ros/status_message.h"
#include "xray_registration/volume/bone_surface.h"

namespace xray_registration {

namespace {

using Clock = std::chrono::steady_clock;

double latencyOf(const std_msgs::Header& header, Clock::time_point arrived) {
  const ros::Time now = ros::Time::now();
  const double since_arrival_s = std::chrono::duration<double>(Clock::now() - arrived).count();
  return frameLatency(!now.isZero() && !header.stamp.isZero(), now.toSec() - header.stamp.toSec(), since_arrival_s);
}

bool somethingAccepted(const RegistrationResult& result) {
  const auto is_accepted = [](const BodyResult& body) { return body.accepted; };
  return result.accepted || std::any_of(result.bodies.begin(), result.bodies.end(), is_accepted);
}

std::vector<NodeStatistics::Body> bodiesOf(const RegistrationStatus& message) {
  std::vector<NodeStatistics::Body> bodies;
  for (const BodyStatus& body : message.bodies) bodies.push_back({body.name, body.accepted ? "" : body.reason});
  return bodies;
}

}  // namespace

RegistrationWorker::RegistrationWorker(const NodeParameters& parameters, Publishers* publishers, Transforms* transforms,
                                       NodeStatistics* statistics, Logger logger, ResultListener* listener,
                                       PosePreview* preview)
    : parameters_(parameters),
      publishers_(publishers),
      transforms_(transforms),
      statistics_(statistics),
      logger_(std::move(logger)),
      listener_(listener),
      preview_(preview),
      loading_(!parameters.ct.path.empty()),
      pipeline_(parameters, logger_),
      pose_requests_(transforms, parameters.frames.tf_timeout_s),
      initial_pose_scope_(parameters.ct.path, parameters.ct.read.series_uid),
      calibration_frames_(static_cast<std::size_t>(parameters.calibration_frames)) {
  mailbox_.post([this] { startUp(); });
  thread_ = std::thread([this] { run(); });
}

RegistrationWorker::~RegistrationWorker() { stop(); }

void RegistrationWorker::stop() {
  stopping_ = true;
  mailbox_.close();
  transforms_->stop();
  if (thread_.joinable()) thread_.join();
  if (surface_.valid()) surface_.wait();
}

void RegistrationWorker::run() {
  FrameMailbox<FrameMessages>::Job job;
  std::optional<FrameMessages> frame;
  const auto picture_due = [this]() -> std::optional<Clock::time_point> {
    if (!picture_) return {};
    return picture_budget_.due(picture_->frame.arrived, Clock::now());
  };
  while (mailbox_.take(&job, &frame, picture_due())) {
    try {
      if (job) job();
      if (frame) handle(*frame);
      publishPictureIfDue();
    } catch (const std::exception& error) {
      // Nothing above is expected to throw; a worker that dies in silence would be worse than a wrong expectation.
      log(logger_, LogLevel::kError, std::string("internal error: ") + error.what());
      statistics_->setError(error.what());
      if (frame) refuse(frame->header, std::string("internal error: ") + error.what());
    }
  }
}

void RegistrationWorker::startUp() {
  try {
    pipeline_.openDevice();
  } catch (const std::exception& error) {
    log(logger_, LogLevel::kError, error.what());
    statistics_->setError(error.what());
  }
  updateStatistics();
  startFromParameters();
  if (!parameters_.ct.path.empty()) {
    loadCtNow(parameters_.ct.path, "");
  } else if (!parameters_.needsCt()) {
    loadBodiesNow();
  } else {
    log(logger_, LogLevel::kWarning, "parameter ct/path is not set: waiting for ~load_ct");
  }
  opening_ = false;
}

void RegistrationWorker::startFromParameters() {
  pose_requests_.clear();
  const bool is_given = parameters_.initial_pose && initial_pose_applies_;
  if (is_given) pose_requests_.add("", {*parameters_.initial_pose, parameters_.initial_pose_frame});
  const auto has_start = [](const BodyParameters& body) { return body.initial_pose.has_value(); };
  register_requested_ = is_given || std::any_of(parameters_.bodies.begin(), parameters_.bodies.end(), has_start);
}

std::future<RegistrationWorker::Answer> RegistrationWorker::loadCt(const std::string& path,
                                                                   const std::string& series_uid) {
  auto promise = std::make_shared<std::promise<Answer>>();
  std::future<Answer> answer = promise->get_future();
  if (loading_.exchange(true)) {
    // Who waits holds a thread that the other services need.
    promise->set_value({false, "a CT is being loaded; ask again when that is done"});
  } else {
    mailbox_.post([this, promise, path, series_uid] { promise->set_value(loadCtNow(path, series_uid)); });
  }
  return answer;
}

RegistrationWorker::Answer RegistrationWorker::loadCtNow(const std::string& path, const std::string& series_uid) {
  picture_.reset();
  const TrackingState before = pipeline_.state();
  statistics_->setState(before == TrackingState::kFault ? before : TrackingState::kWaitingForCt);
  Answer answer;
  try {
    pipeline_.loadCt(path, series_uid);
    answer = {true, "loaded " + pipeline_.ctName()};
    log(logger_, LogLevel::kInfo, "loaded CT " + pipeline_.ctName());
  } catch (const std::exception& error) {
    answer = {false, error.what()};
    log(logger_, LogLevel::kError, std::string("the CT was not loaded: ") + error.what());
    statistics_->setError(error.what());
  }
  // Also a CT that was read and that the device refused has taken the place of the one before.
  if (pipeline_.ct()) {
    initial_pose_applies_ = initial_pose_scope_.covers(path, series_uid);
    if (parameters_.initial_pose && !initial_pose_applies_) {
      log(logger_, LogLevel::kWarning, "parameter initial_pose is for another CT: this one needs a start of its own");
    }
    startFromParameters();
  }
  calibration_frames_.forget();
  loading_ = false;
  updateStatistics();
  if (pipeline_.ct()) publishSurfaces();
  return answer;
}

/// Bodies that have CTs or meshes of their own, with no CT around them.
void RegistrationWorker::loadBodiesNow() {
  statistics_->setState(pipeline_.state());
  try {
    pipeline_.loadBodies();
    initial_pose_scope_.covers("", "");  // The initial pose is the first body's, not that of a CT that comes later.
    for (const FollowedBodyInfo& body : pipeline_.followedBodies()) {
      log(logger_, LogLevel::kInfo, "loaded body " + body.name);
    }
  } catch (const std::exception& error) {
    log(logger_, LogLevel::kError, std::string("the bodies were not loaded: ") + error.what());
    statistics_->setError(error.what());
  }
  updateStatistics();
  publishSurfaces();
}

std::future<Calibrate::Response> RegistrationWorker::calibrate() {
  auto promise = std::make_shared<std::promise<Calibrate::Response>>();
  std::future<Calibrate::Response> answer = promise->get_future();
  if (calibrating_.exchange(true)) {
    Calibrate::Response busy;
    busy.message = "a calibration is being worked out; ask again when that is done";
    promise->set_value(busy);
  } else {
    mailbox_.post([this, promise] {
      promise->set_value(calibrateNow());
      calibrating_ = false;
    });
  }
  return answer;
}

Calibrate::Response RegistrationWorker::calibrateNow() {
  Calibrate::Response answer;
  Engine* engine = pipeline_.engine();
  if (engine == nullptr) {
    answer.message = pipeline_.hasCt() ? "only method fast can calibrate" : "no CT is loaded";
  } else if (calibration_frames_.size() == 0) {
    answer.message = parameters_.calibration_frames == 0
                         ? "parameter calibration/frames is 0: no frames are kept to calibrate with"
                         : "no frame with all views was registered yet whose X-ray looks like the DRR";
  }
  if (!answer.message.empty()) return answer;
  log(logger_, LogLevel::kInfo, "calibrating with " + std::to_string(calibration_frames_.size()) + " frames");
  try {
    const GeometryCalibration found = calibration_frames_.calibrate(engine, parameters_.image, [this] {
      if (stopping_) throw std::runtime_error("the node is shutting down");
    });
    std::vector<RigidTransform> T_view_first;
    for (const ViewGeometry& view : toldGeometry(calibration_frames_.told())) T_view_first.push_back(view.T_view_first);
    answer = calibrationAnswer(parameters_.viewNames(), last_to_calibrate_, found, T_view_first);
    log(logger_, LogLevel::kInfo, "calibrated (nothing is applied): " + answer.message);
  } catch (const DeviceError& error) {
    const bool rebuilt = pipeline_.rebuildAfter(error.what());
    answer.message = std::string("the device failed: ") + error.what() + (rebuilt ? " (it was opened anew)" : "");
    updateStatistics();
  } catch (const std::exception& error) {
    answer.message = std::string("the calibration failed: ") + error.what();
    log(logger_, LogLevel::kError, answer.message);
  }
  return answer;
}

void RegistrationWorker::publishSurfaces() {
  pipeline_.dropCt();
  if (preview_ != nullptr) preview_->forgetPoses();
  if (parameters_.ct.surface_triangles == 0 && listener_ == nullptr) return;
  if (surface_.valid()) surface_.wait();
  try {
    surface_ = std::async(std::launch::async, [this, shapes = pipeline_.shapes()] { makeSurfaces(shapes); });
  } catch (const std::exception& error) {
    // Memory for a thread is missing; what is registered needs no surface.
    log(logger_, LogLevel::kWarning, std::string("the CT's surface is not made: ") + error.what());
  }
}

/// On a thread of its own: of a large CT it takes seconds.
void RegistrationWorker::makeSurfaces(const std::vector<BodyShape>& shapes) {
  const auto triangles = static_cast<std::size_t>(parameters_.ct.surface_triangles);
  // What stands for the CT is shown as a body: nothing is left of a CT that was shown before.
  if (triangles > 0 && (shapes.empty() || !shapes.front().name.empty())) publishers_->surface("", {});
  std::vector<ShownShape> shown;
  for (const BodyShape& shape : shapes) {
    if (stopping_) return;
    TriangleMesh mesh;
    try {
      if (triangles > 0) {
        mesh = isoSurface(*shape.volume, shape.surface_per_mm, triangles);
        publishers_->surface(shape.name, mesh);
      }
    } catch (const std::exception& error) {
      log(logger_, LogLevel::kWarning, "no surface of " + shape.name + ": " + error.what());
    }
    if (listener_ == nullptr) continue;
    shown.push_back(
        {shape.name, anatomicalCentreCt(*shape.volume), std::make_shared<const TriangleMesh>(std::move(mesh))});
  }
  if (listener_ != nullptr) listener_->takeShapes(std::move(shown));
}

void RegistrationWorker::updateStatistics() {
  statistics_->setState(pipeline_.state());
  statistics_->setDevice(pipeline_.deviceName(), pipeline_.deviceBytes());
  statistics_->setCt(pipeline_.ctName());
  if (!pipeline_.fault().empty()) statistics_->setError(pipeline_.fault());
  const std::lock_guard<std::mutex> lock(ct_grid_mutex_);
  ct_grid_ = pipeline_.ctGrid();
}

std::optional<VolumeGrid> RegistrationWorker::ctGrid() const {
  const std::lock_guard<std::mutex> lock(ct_grid_mutex_);
  return ct_grid_;
}

void RegistrationWorker::setPose(const RigidTransform& T_frame_ct, const std::string& frame_id,
                                 const std::string& body) {
  mailbox_.post([this, T_frame_ct, frame_id, body] {
    pose_requests_.add(body, {T_frame_ct, frame_id});
    register_requested_ = true;
  });
}

void RegistrationWorker::registerOnce() {
  mailbox_.post([this] { register_requested_ = true; });
}

void RegistrationWorker::restart(const std::string& why) {
  forgetCameraFrame();
  if (const std::optional<FrameMessages> waiting = mailbox_.clear()) drop(*waiting);
  mailbox_.post([this, why] { restartNow(why); });
}

void RegistrationWorker::restartNow(const std::string& why) {
  log(logger_, LogLevel::kWarning, why + ": the pose is forgotten, the CT is kept");
  picture_.reset();
  pipeline_.reset();
  newest_.reset();
  if (preview_ != nullptr) preview_->forgetPoses();
  if (listener_ != nullptr) listener_->forgetPoses();
  publishers_->forgetStamps();
  bindCameraFrame("");
  calibration_frames_.forget();
  startFromParameters();
  updateStatistics();
}

void RegistrationWorker::stampsWereSet() {
  if (const std::optional<FrameMessages> waiting = mailbox_.clear()) drop(*waiting);
  mailbox_.post([this] {
    log(logger_, LogLevel::kWarning, "the images' stamps go on elsewhere: a clock was set; the pose is kept");
    publishers_->forgetStamps();
    transforms_->forget();
  });
}

void RegistrationWorker::setTuning(const RegistrarOptions& registrar, const TrackerOptions& tracker) {
  mailbox_.post([this, registrar, tracker] {
    pipeline_.setTuning(registrar, tracker);
    updateStatistics();
  });
}

std::string RegistrationWorker::cameraFrame() const {
  const std::lock_guard<std::mutex> lock(camera_frame_mutex_);
  return camera_frame_;
}

/// Everything is said in the first view's frame. Returns why an image cannot change it.
std::string RegistrationWorker::takeCameraFrame(const ViewMessage& first) {
  if (!first.image) return "";
  const std::string frame = tfFrame(first.image->header.frame_id);
  if (frame.empty()) return "";
  const std::lock_guard<std::mutex> lock(camera_frame_mutex_);
  std::string problem = frameChangeProblem(frame, bound_frame_, parameters_.frames);
  if (problem.empty()) camera_frame_ = frame;
  return problem;
}

void RegistrationWorker::bindCameraFrame(const std::string& frame) {
  const std::lock_guard<std::mutex> lock(camera_frame_mutex_);
  bound_frame_ = frame;
}

void RegistrationWorker::forgetCameraFrame() {
  const std::lock_guard<std::mutex> lock(camera_frame_mutex_);
  camera_frame_.clear();
  bound_frame_.clear();
}

void RegistrationWorker::refuseImage(const std_msgs::Header& header, const std::string& reason) {
  statistics_->frameReceived();
  refuse(header, reason);
}

void RegistrationWorker::offer(FrameMessages frame) {
  statistics_->frameReceived();
  picture_budget_.frameCame(frame.arrived);
  frame.header.frame_id = tfFrame(frame.header.frame_id);
  if (const std::string problem = takeCameraFrame(frame.views.front()); !problem.empty()) {
    return refuse(frame.header, problem);
  }
  if (!enabled_) return refuse(frame.header, "registration is switched off (~set_enabled)");
  if (loading_) return refuse(frame.header, "a CT is being loaded");
  if (calibrating_) return refuse(frame.header, "a calibration is being worked out (~calibrate)");
  if (searching_) return refuse(frame.header, "the CT is being searched for (~localize)");
  if (opening_) {
    return refuse(frame.header, parameters_.needsCt() ? "no CT is loaded; the device is being opened"
                                                      : "the bodies are being loaded");
  }
  if (const std::optional<FrameMessages> replaced = mailbox_.put(std::move(frame))) drop(*replaced);
}

void RegistrationWorker::drop(const FrameMessages& frame) {
  statistics_->frameDropped();
  sayUnregistered(frame.header, "dropped: a newer frame came before this one was looked at");
}

void RegistrationWorker::refuse(const std_msgs::Header& header, const std::string& reason) {
  statistics_->frameRefused(reason);
  sayUnregistered(header, reason);
}

void RegistrationWorker::sayUnregistered(const std_msgs::Header& header, const std::string& reason) {
  FrameOutcome outcome;
  outcome.result.reason = reason;
  RegistrationStatus message = statusMessage(outcome, header, parameters_.bodies);
  message.latency = latencyOf(header, Clock::now());
  setNodeFields(statistics_->snapshot(), &message);
  publishers_->status(message);
}

/// A frame that somebody wanted to have registered.
void RegistrationWorker::refuseUnusable(const std_msgs::Header& header, const std::string& reason) {
  pipeline_.noteUnusable();
  updateStatistics();
  refuse(header, reason);
}

void RegistrationWorker::watch() {
  if (watching_.exchange(true)) return;
  mailbox_.post([this] {
    watching_ = false;
    watchNow();
  });
}

void RegistrationWorker::watchNow() {
  if (parameters_.mode != Mode::kTrack || pipeline_.state() != TrackingState::kTracking) return;
  const double since_s = std::chrono::duration<double>(Clock::now() - last_looked_at_).count();
  if (since_s <= parameters_.health.pose_age_error_s) return;
  const NodeStatistics::Snapshot values = statistics_->snapshot();
  const bool silent = values.image_age_s.value_or(values.uptime_s) >= since_s;
  char text[96];
  std::snprintf(text, sizeof text, "no X-ray could be registered for %.1f s: ", since_s);
  loseTrack(text + (silent ? "no image came" : values.last_refusal));
}

void RegistrationWorker::loseTrack(const std::string& why) {
  if (pipeline_.state() != TrackingState::kTracking) return;
  pipeline_.loseTrack();
  updateStatistics();
  log(logger_, LogLevel::kWarning, "LOST: " + why);
}

void RegistrationWorker::handle(const FrameMessages& frame) {
  std_msgs::Header header = frame.header;
  if (frame.views.front().image) newest_ = frame;
  if (parameters_.mode == Mode::kOnDemand && !register_requested_) {
    keepToShow(frame, header);
    return refuse(header, "mode is on_demand: waiting for a pose or ~register_once");
  }
  // Everything is said in the first view's frame, also when that view is missing for once.
  if (!frame.views.front().image) header.frame_id = cameraFrame();
  if (header.frame_id.empty()) {
    return refuseUnusable(frame.header, frame.views.front().image ? "the image has no frame_id"
                                                                  : "the first view's frame is not known yet");
  }
  if (const std::string problem = frameProblem(header.frame_id, parameters_.frames, parameters_.bodies);
      !problem.empty()) {
    return refuseUnusable(header, problem);
  }
  // Asked again: another frame may have been accepted since this one came.
  if (const std::string problem = takeCameraFrame(frame.views.front()); !problem.empty())
    return refuse(header, problem);
  keepToShow(frame, header);
  if (moved_by_hand_ && pipeline_.state() != TrackingState::kTracking) {
    return refuse(header, "the CT is being moved by hand (~ct_marker)");
  }
  const FrameOutcome outcome = registerFrame(frame, header);
  if (preview_ != nullptr) shown_frame_.views = outcome.views;
  publishOutcome(frame, header, outcome);
}

std::string RegistrationWorker::heldProblem(const FrameMessages& frame) const {
  return xray_registration::heldProblem(frame, parameters_.viewNames(), parameters_.sync.allow_missing_view);
}

std::vector<RawView> RegistrationWorker::rawViews(const FrameMessages& frame, const std::string& camera_frame) const {
  const std::vector<std::string> names = parameters_.viewNames();
  std::vector<RawView> views(frame.views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ViewMessage& message = frame.views[i];
    RawView& view = views[i];
    view.name = names[i];
    view.problem = message.problem.empty() ? xray_registration::heldProblem(message) : message.problem;
    if (!view.problem.empty()) continue;
    try {
      if (i > 0) {
        const std::string view_frame = tfFrame(message.image->header.frame_id);
        const std::string problem = frameProblem(view_frame, parameters_.frames, parameters_.bodies);
        if (!problem.empty()) throw FrameError(problem);
        std::string why;
        const std::optional<RigidTransform> T_view_first =
            transforms_->lookup(view_frame, camera_frame, frame.header.stamp, parameters_.frames.tf_timeout_s, &why);
        if (!T_view_first) throw FrameError(why);
        view.T_view_first = *T_view_first;
      }
      view.calibration = calibration(*message.info);
      view.image = rawImage(*message.image);
    } catch (const FrameError& error) {
      view.problem = error.what();
    }
  }
  return views;
}

std::string RegistrationWorker::resolvePose(const std_msgs::Header& header) {
  std::string body_problem;
  std::string problem = pose_requests_.handOn(header, &pipeline_, &body_problem);
  if (!body_problem.empty()) statistics_->setError(body_problem);
  return problem;
}

bool RegistrationWorker::canRegister(const std_msgs::Header& header) const {
  return pipeline_.fault().empty() && pipeline_.hasCt() && pipeline_.hasStart(header.stamp.toSec());
}

/// Where the camera is in frames/fixed: asked once for a frame, for its start and for tf. A frame for which that is not
/// known could not be published, so it is not registered either.
std::string RegistrationWorker::findCamera(const std_msgs::Header& header) {
  // What the pipeline refuses anyway needs no transform, and its reason comes first.
  if (!parameters_.frames.fixed.empty() && !canRegister(header)) {
    T_fixed_camera_.reset();
    return "";
  }
  return lookUpCamera(header);
}

std::string RegistrationWorker::lookUpCamera(const std_msgs::Header& header) {
  T_fixed_camera_ = RigidTransform::Identity();
  if (parameters_.frames.fixed.empty()) return "";
  std::string why;
  T_fixed_camera_ = transforms_->lookup(parameters_.frames.fixed, header.frame_id, header.stamp,
                                        parameters_.frames.tf_timeout_s, &why);
  return T_fixed_camera_ ? "" : why;
}

FrameOutcome RegistrationWorker::registerFrame(const FrameMessages& frame, const std_msgs::Header& header) {
  FrameOutcome refused;
  refused.result.reason = resolvePose(header);
  if (refused.result.reason.empty() && canRegister(header)) {
    refused.result.reason = heldProblem(frame);
    if (!refused.result.reason.empty()) {
      // A held image is only nothing new: it counts by the time for which it is held. For too long it says nothing of
      // where the CT is now.
      if (longestHeld(frame) > parameters_.health.hold_timeout_s) loseTrack(refused.result.reason);
      return refused;
    }
  }
  if (refused.result.reason.empty()) refused.result.reason = findCamera(header);
  if (!refused.result.reason.empty()) {
    pipeline_.noteUnusable();
    return refused;
  }
  std::optional<RigidTransform> T_camera_now_camera_last;
  if (!parameters_.frames.fixed.empty() && T_fixed_camera_ && pipeline_.lastAcceptedStamp()) {
    T_camera_now_camera_last = T_fixed_camera_->inverse() * T_fixed_camera_accepted_;
  }
  FrameOutcome outcome =
      pipeline_.process(header.stamp.toSec(), rawViews(frame, header.frame_id), T_camera_now_camera_last);
  keepToCalibrate(frame, outcome);
  return outcome;
}

/// Accepted or not: a geometry that is wrong is what a frame may have been refused for.
void RegistrationWorker::keepToCalibrate(const FrameMessages& frame, const FrameOutcome& outcome) {
  const bool fits =
      outcome.registered && outcome.views_missing.empty() && outcome.result.similarity >= kAlikeEnoughToCalibrate;
  if (!fits) return;
  std::vector<RigidTransform> T_view_first;
  for (const std::optional<ViewInput>& view : outcome.views) T_view_first.push_back(view->T_view_first);
  const auto views = [frame, T_view_first, names = parameters_.viewNames()] {
    std::vector<RawView> told(frame.views.size());
    for (std::size_t i = 0; i < told.size(); ++i) {
      told[i].name = names[i];
      told[i].T_view_first = T_view_first[i];
      told[i].calibration = calibration(*frame.views[i].info);
      told[i].image = rawImage(*frame.views[i].image);
    }
    return told;
  };
  calibration_frames_.add(views, outcome.result.T_camera_ct, pipeline_.centreCt());
  last_to_calibrate_ = frame;
}

void RegistrationWorker::publishOutcome(const FrameMessages& frame, const std_msgs::Header& header,
                                        const FrameOutcome& outcome) {
  const RegistrationResult& result = outcome.result;
  if (outcome.registered) {
    register_requested_ = false;
    last_looked_at_ = Clock::now();
    statistics_->frameRegistered();
    statistics_->setSuspicions(result.suspicions);
  }
  if (somethingAccepted(result)) bindCameraFrame(header.frame_id);
  // Where the camera is, is known of every frame that was looked at.
  if (result.accepted) T_fixed_camera_accepted_ = T_fixed_camera_.value();
  if (T_fixed_camera_) publishers_->sendResult(header, result, pipeline_.centreCt(), *T_fixed_camera_);
  updateStatistics();
  RegistrationStatus message = statusMessage(outcome, header, parameters_.bodies);
  message.latency = latencyOf(header, frame.arrived);
  if (result.accepted) {
    statistics_->frameAccepted(message.latency, result.solve_ms);
  } else {
    statistics_->frameRefused(result.reason);
  }
  setNodeFields(statistics_->snapshot(), &message);
  statistics_->setBodies(bodiesOf(message));
  publishers_->status(message);
  if (outcome.registered && preview_ != nullptr) preview_->takeResult(result);
  if (outcome.registered && listener_ != nullptr) listener_->takeResult(result);
  keepPicture(frame, outcome);
}

/// The pose comes first: a picture is made when no frame has to wait for it.
void RegistrationWorker::keepPicture(const FrameMessages& frame, const FrameOutcome& outcome) {
  picture_.reset();
  if (!outcome.registered && !somethingAccepted(outcome.result)) return;
  for (std::size_t i = 0; i < outcome.views.size(); ++i) {
    if (publishers_->wantsDrr(i) || publishers_->wantsOverlay(i)) picture_ = {frame, outcome};
  }
}

void RegistrationWorker::publishPictureIfDue() {
  const Clock::time_point start = Clock::now();
  if (!picture_ || picture_budget_.due(picture_->frame.arrived, start) > start) return;
  const std::optional<Shown> shown = std::exchange(picture_, std::nullopt);
  publishPictures(shown->frame, shown->outcome);
  picture_budget_.made(start, Clock::now());
}

void RegistrationWorker::publishPictures(const FrameMessages& frame, const FrameOutcome& outcome) {
  for (std::size_t i = 0; i < outcome.views.size(); ++i) {
    if (!outcome.views[i]) continue;
    std_msgs::Header header = frame.views[i].image->header;  // The view's own: where and when it was taken.
    header.frame_id = tfFrame(header.frame_id);
    try {
      publishView(i, header, outcome);
    } catch (const std::exception& error) {
      log(logger_, LogLevel::kWarning, std::string("no picture of the result: ") + error.what());
    }
  }
}

void RegistrationWorker::publishView(std::size_t view, const std_msgs::Header& header, const FrameOutcome& outcome) {
  const RegistrationResult& result = outcome.result;
  const ViewInput& whole = *outcome.views[view];
  const bool wants_drr = somethingAccepted(result) && publishers_->wantsDrr(view);
  DrrParts parts;
  if (wants_drr) {
    parts = pipeline_.renderParts(whole, result);
    const FloatImage drr = acceptedDrr(parts, result);
    if (!drr.empty()) publishers_->drr(view, header, drr);
  }
  if (!publishers_->wantsOverlay(view)) return;
  const ViewInput shown = forDisplay(whole);
  if (!wants_drr || shown.xray != whole.xray) parts = pipeline_.renderParts(shown, result);
  const std::vector<OverlayLine> lines = overlayLines(parts, result, parameters_.bodies);
  if (!lines.empty()) publishers_->overlay(view, header, *shown.xray, lines);
}

void RegistrationWorker::keepToShow(const FrameMessages& frame, const std_msgs::Header& header) {
  if (preview_ != nullptr) shown_frame_ = {frame, header, {}};
  const sensor_msgs::CameraInfoConstPtr& info = frame.views.front().info;
  if (listener_ == nullptr || !info || header.frame_id.empty()) return;
  try {
    listener_->takeCamera(header.frame_id, cameraOf(calibration(*info)));
  } catch (const FrameError&) {
    // The frame is refused for it.
  }
}

bool RegistrationWorker::preview(const PreviewRequest& request) {
  if (preview_ == nullptr || Clock::now() < next_preview_.load() || previewing_.exchange(true)) return false;
  mailbox_.post([this, request] {
    const Clock::time_point start = Clock::now();
    previewNow(request);
    const Clock::time_point end = Clock::now();
    // Frames that are tracked get half of the time; those that wait for the hand are refused, and need none.
    const bool frames_are_refused = moved_by_hand_ && pipeline_.state() != TrackingState::kTracking;
    next_preview_ = frames_are_refused ? end : end + (end - start);
    previewing_ = false;
  });
  return true;
}

void RegistrationWorker::previewNow(const PreviewRequest& request) {
  if (!preview_->isWanted() || shown_frame_.messages.views.empty() || !pipeline_.hasCt()) return;
  try {
    if (shown_frame_.views.empty()) {
      FrameViews prepared = pipeline_.prepare(rawViews(shown_frame_.messages, shown_frame_.header.frame_id));
      shown_frame_.views = std::move(prepared.views);
    }
    std::vector<std_msgs::Header> headers;
    for (const ViewMessage& view : shown_frame_.messages.views) {
      headers.push_back(view.image ? view.image->header : shown_frame_.header);
    }
    preview_->show(request, shown_frame_.views, headers, &pipeline_);
  } catch (const std::exception& error) {
    log(logger_, LogLevel::kWarning, std::string("no picture of the pose that is tried: ") + error.what());
  }
}

}  // namespace xray_registration

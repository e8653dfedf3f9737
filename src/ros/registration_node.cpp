#include "xray_registration/ros/registration_node.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <image_transport/camera_common.h>
#include <ros/console.h>

#include <boost/make_shared.hpp>
#include <chrono>
#include <utility>

#include "ct_hand.h"
#include "landmark_answer.h"
#include "landmark_solver.h"
#include "live_parameters.h"
#include "localize_server.h"
#include "tuning_server.h"
#include "xray_registration/common/escaped.h"
#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/node_parameters.h"
#include "xray_registration/ros/result_transforms.h"

namespace xray_registration {

namespace {

// What roscpp's own queue loses is counted by nobody. The callback only pairs and stores, so a queue this deep is empty
// again at once, and it is the mailbox that replaces frames and counts them.
constexpr int kQueueSize = 8;
constexpr int kInfoQueueSize = 32;
constexpr double kWatchPeriod = 0.1;        // s, on the wall
constexpr double kDiagnosticsPeriod = 1.0;  // s, on the wall: goes on while a simulated clock stands

ros::NodeHandle withQueue(const ros::NodeHandle& node, ros::CallbackQueue* queue) {
  ros::NodeHandle result(node);
  result.setCallbackQueue(queue);
  return result;
}

ViewSynchroniser::Options synchroniserOptions(const NodeParameters& parameters) {
  ViewSynchroniser::Options options;
  options.views = parameters.viewNames();
  options.tolerance_s = parameters.sync.tolerance_s;
  options.patience = std::chrono::milliseconds(static_cast<int>(parameters.sync.patience_s * 1000.0));
  return options;
}

/// Why a request cannot be about this body; empty when it can. Without a name it is about the CT.
std::string nameProblem(const std::string& body, const std::vector<BodyParameters>& bodies) {
  if (body.empty()) return "";
  std::string names;
  for (const BodyParameters& known : bodies) {
    if (known.name == body) return "";
    names += (names.empty() ? "" : ", ") + known.name;
  }
  return "there is no body '" + body + "'; the parameter bodies has " + (names.empty() ? "none" : names);
}

}  // namespace

Logger rosLogger() {
  return [](LogLevel level, const std::string& text) {
    switch (level) {
      case LogLevel::kDebug:
        ROS_DEBUG_STREAM(text);
        break;
      case LogLevel::kInfo:
        ROS_INFO_STREAM(text);
        break;
      case LogLevel::kWarning:
        ROS_WARN_STREAM(text);
        break;
      case LogLevel::kError:
        ROS_ERROR_STREAM(text);
        break;
    }
  };
}

RegistrationNode::RegistrationNode(const ros::NodeHandle& node, const ros::NodeHandle& private_node)
    : image_node_(withQueue(node, &image_queue_)),
      service_node_(withQueue(node, &service_queue_)),
      private_node_(withQueue(private_node, &service_queue_)),
      parameters_(loadParameters(private_node, rosLogger())),
      publishers_(private_node_, parameters_),
      landmarks_(std::make_unique<LandmarkSolver>(parameters_, &transforms_)),
      hand_(std::make_unique<CtHand>(CtHand::Nodes{node, private_node}, parameters_, &transforms_, &publishers_,
                                     landmarks_.get())),
      preview_(std::make_unique<PosePreview>(private_node_, parameters_)),
      worker_(std::make_unique<RegistrationWorker>(parameters_, &publishers_, &transforms_, &statistics_, rosLogger(),
                                                   hand_.get(), preview_.get())),
      synchroniser_(synchroniserOptions(parameters_),
                    [this](FrameMessages frame) { worker_->offer(std::move(frame)); }),
      gate_(parameters_.viewNames().size(), parameters_.stamps, ros::Time::isSimTime(),
            parameters_.health.hold_timeout_s > 0.0),
      clock_(ros::Time::isSimTime()),
      registrar_options_(parameters_.registrar),
      tracker_options_(parameters_.tracker) {
  diagnostics_ =
      std::make_unique<diagnostic_updater::Updater>(service_node_, private_node_, private_node_.getNamespace());
  diagnostics_->setHardwareID("none");
  diagnostics_->add("registration", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
  serveTuning();
  advertiseServices();
  localize_server_ = std::make_unique<LocalizeServer>(private_node_, worker_.get());
  nameInputs();
  serveHand();
  subscribe();
  watch_timer_ =
      image_node_.createWallTimer(ros::WallDuration(kWatchPeriod), [this](const ros::WallTimerEvent&) { watch(); });
  diagnostics_timer_ =
      service_node_.createWallTimer(ros::WallDuration(kDiagnosticsPeriod), [this](const ros::WallTimerEvent&) {
        diagnostics_->force_update();
        help();
      });
  image_spinner_ = std::make_unique<ros::AsyncSpinner>(1, &image_queue_);
  // Two: one ~load_ct at a time waits for the worker, and the others must be answered meanwhile.
  service_spinner_ = std::make_unique<ros::AsyncSpinner>(2, &service_queue_);
  image_spinner_->start();
  service_spinner_->start();
  master_watch_ = std::make_unique<MasterWatch>(rosLogger());
}

RegistrationNode::~RegistrationNode() {
  master_watch_.reset();
  watch_timer_.stop();
  diagnostics_timer_.stop();
  image_spinner_->stop();
  image_subscribers_.clear();
  info_subscribers_.clear();
  for (ros::Subscriber& subscriber : pose_subscribers_) subscriber.shutdown();
  hand_->stop();
  localize_server_.reset();
  worker_->stop();  // Answers a ~load_ct that waits, so that the service threads can end.
  for (ros::ServiceServer& service : services_) service.shutdown();
  service_spinner_->stop();
}

void RegistrationNode::nameInputs() {
  for (const std::string& view : parameters_.viewNames()) {
    Input& input = inputs_.emplace_back();
    // The CameraInfo stands beside the image, wherever that was remapped to.
    input.image_topic = image_node_.resolveName(view.empty() ? "image_raw" : view + "/image_raw");
    input.info_topic = image_transport::getCameraInfoTopic(input.image_topic);
    ROS_INFO_STREAM("X-rays are taken from " << input.image_topic << ", their geometry from " << input.info_topic);
  }
}

void RegistrationNode::serveHand() {
  std::vector<std::string> image_topics;
  for (const Input& input : inputs_) image_topics.push_back(input.image_topic);
  hand_->serve(
      worker_.get(), [this] { resetAll(); }, image_topics);
}

void RegistrationNode::subscribe() {
  image_subscribers_.clear();
  info_subscribers_.clear();
  image_transport::ImageTransport transport(image_node_);
  // Both at once: with Nagle's algorithm a camera_info waits for the answer to the one before it, on a slow link longer
  // than an image waits for its camera_info.
  const ros::TransportHints at_once = ros::TransportHints().tcpNoDelay();
  const image_transport::TransportHints hints(parameters_.image_transport, at_once, private_node_);
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    info_subscribers_.push_back(image_node_.subscribe<sensor_msgs::CameraInfo>(
        inputs_[i].info_topic, kInfoQueueSize,
        [this, i](const sensor_msgs::CameraInfoConstPtr& info) {
          ++inputs_[i].infos;
          followClock();
          landmarks_->takeInfo(i, info);
          synchroniser_.addInfo(i, info);
        },
        ros::VoidConstPtr(), at_once));
    image_subscribers_.push_back(transport.subscribe(
        inputs_[i].image_topic, kQueueSize, [this, i](const sensor_msgs::ImageConstPtr& image) { takeImage(i, image); },
        ros::VoidPtr(), hints));
  }
}

void RegistrationNode::takeImage(std::size_t view, const sensor_msgs::ImageConstPtr& image) {
  ++inputs_[view].images;
  followClock();
  const ImageGate::Clock::time_point arrived = ImageGate::Clock::now();
  const ImageGate::Judgement judgement = gate_.judge(view, *image, ros::Time::now(), arrived);
  if (!judgement.stamp.problem.empty()) {
    const std::string name = view == 0 ? "" : "view '" + parameters_.views[view] + "': ";
    return worker_->refuseImage(image->header, name + judgement.stamp.problem);
  }
  // What the first view's stamps do says what the stream does; a further view is taken beside it or not at all.
  if (view == 0 && judgement.stamp.verdict == StampVerdict::kRecordingAgain) {
    worker_->restart("the images' stamps went back");
  } else if (view == 0 && judgement.stamp.verdict == StampVerdict::kClockSet) {
    worker_->stampsWereSet();
  }
  synchroniser_.addImage(view, image, arrived, judgement.held_for_s);
}

void RegistrationNode::followClock() {
  if (!clock_.wentBack(sinceZero(ros::Time::now()))) return;
  worker_->restart("the clock went back");
  gate_.forget();
  synchroniser_.clear();
  resubscribe_ = true;
}

void RegistrationNode::watch() {
  followClock();
  // Not inside an image callback: a subscription must not be torn down from within itself.
  if (resubscribe_) {
    resubscribe_ = false;
    subscribe();
  }
  synchroniser_.expire(ViewSynchroniser::Clock::now());
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    inputs_[i].image_publishers = static_cast<int>(image_subscribers_[i].getNumPublishers());
  }
  worker_->watch();
}

void RegistrationNode::advertiseServices() {
  services_.push_back(private_node_.advertiseService("load_ct", &RegistrationNode::loadCt, this));
  services_.push_back(private_node_.advertiseService("calibrate", &RegistrationNode::calibrate, this));
  services_.push_back(private_node_.advertiseService("set_initial_pose", &RegistrationNode::setInitialPose, this));
  services_.push_back(private_node_.advertiseService("register_landmarks", &RegistrationNode::registerLandmarks, this));
  services_.push_back(private_node_.advertiseService("reset", &RegistrationNode::reset, this));
  services_.push_back(private_node_.advertiseService("register_once", &RegistrationNode::registerOnce, this));
  services_.push_back(private_node_.advertiseService("set_enabled", &RegistrationNode::setEnabled, this));
  subscribePose("initialpose", service_node_, "");
  for (const BodyParameters& body : parameters_.bodies) {
    subscribePose("bodies/" + body.name + "/initialpose", private_node_, body.name);
  }
}

void RegistrationNode::subscribePose(const std::string& topic, const ros::NodeHandle& node, const std::string& body) {
  ros::NodeHandle handle(node);
  pose_subscribers_.push_back(handle.subscribe<geometry_msgs::PoseWithCovarianceStamped>(
      topic, 1, [this, topic, body](const geometry_msgs::PoseWithCovarianceStampedConstPtr& message) {
        const RegistrationWorker::Answer answer = takePose(message->header, message->pose.pose, body);
        if (!answer.success) say(topic + ": " + answer.message);
      }));
}

bool RegistrationNode::loadCt(LoadCt::Request& request, LoadCt::Response& response) {
  if (request.path.empty()) {
    response.message = "path is empty; a file or a DICOM folder is needed";
    return true;
  }
  try {
    const RegistrationWorker::Answer answer = worker_->loadCt(request.path, request.series_uid).get();
    response.success = static_cast<std::uint8_t>(answer.success);
    response.message = escaped(answer.message);
  } catch (const std::future_error&) {
    response.message = "the node is shutting down";
  }
  return true;
}

bool RegistrationNode::calibrate(Calibrate::Request& /*request*/, Calibrate::Response& response) {
  try {
    response = worker_->calibrate().get();
    response.message = escaped(response.message);
  } catch (const std::future_error&) {
    response.message = "the node is shutting down";
  }
  return true;
}

RegistrationWorker::Answer RegistrationNode::takePose(const std_msgs::Header& header, const geometry_msgs::Pose& pose,
                                                      const std::string& body) {
  if (const std::string problem = nameProblem(body, parameters_.bodies); !problem.empty()) return {false, problem};
  const std::string frame = tfFrame(header.frame_id);
  if (frame.empty()) return {false, "header.frame_id is empty; name the frame that the pose is in"};
  if (const std::string problem = startFrameProblem(frame, parameters_.frames, parameters_.bodies); !problem.empty()) {
    return {false, problem};
  }
  RigidTransform T_frame_ct;
  try {
    T_frame_ct = fromPose(pose, "the initial pose");
  } catch (const std::invalid_argument& error) {
    return {false, error.what()};
  }
  const std::string camera_frame = worker_->cameraFrame();
  if (!camera_frame.empty()) {
    std::string why;
    if (!transforms_.lookup(camera_frame, frame, ros::Time(), 0.5, &why)) return {false, why};
  }
  worker_->setPose(T_frame_ct, frame, body);
  return {true, camera_frame.empty() ? "taken; it is used when the first image comes" : "taken"};
}

bool RegistrationNode::setInitialPose(SetInitialPose::Request& request, SetInitialPose::Response& response) {
  const RegistrationWorker::Answer answer = takePose(request.pose.header, request.pose.pose, request.body);
  response.success = static_cast<std::uint8_t>(answer.success);
  response.message = escaped(answer.message);
  return true;
}

bool RegistrationNode::registerLandmarks(RegisterLandmarks::Request& request, RegisterLandmarks::Response& response) {
  response = landmarkAnswer(request, *landmarks_, worker_->ctGrid());
  if (response.success == 0) return true;
  worker_->setPose(fromPose(response.pose.pose), response.pose.header.frame_id);
  return true;
}

void RegistrationNode::resetAll() {
  worker_->restart("~reset");
  gate_.forget();
}

bool RegistrationNode::reset(std_srvs::Trigger::Request& /*request*/, std_srvs::Trigger::Response& response) {
  resetAll();
  response.success = 1;
  return true;
}

bool RegistrationNode::registerOnce(std_srvs::Trigger::Request& /*request*/, std_srvs::Trigger::Response& response) {
  const bool on_demand = parameters_.mode == Mode::kOnDemand;
  if (on_demand) worker_->registerOnce();
  response.success = static_cast<std::uint8_t>(on_demand);
  response.message = on_demand ? "the next usable frame is registered" : "mode is track: every frame is registered";
  return true;
}

bool RegistrationNode::setEnabled(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  worker_->setEnabled(request.data != 0);
  response.success = 1;
  response.message = request.data != 0 ? "frames are registered" : "frames are refused until switched on again";
  return true;
}

void RegistrationNode::say(const std::string& error) {
  ROS_ERROR_STREAM(escaped(error));
  statistics_.setError(error);
}

void RegistrationNode::serveTuning() {
  const auto serve = [this](auto* server, const char* group, const auto& start, auto* options) {
    using Server = typename std::remove_reference_t<decltype(**server)>;
    const auto apply_and_tell = [this, options](const auto& config) {
      const std::lock_guard<std::mutex> lock(tuning_mutex_);
      apply(config, options);
      worker_->setTuning(registrar_options_, tracker_options_);
    };
    *server = std::make_unique<Server>(ros::NodeHandle(private_node_, group), start, apply_and_tell,
                                       [this](const std::string& why) { say(why); });
  };
  serve(&accept_server_, "accept", toConfig(registrar_options_.accept), &registrar_options_.accept);
  serve(&solver_server_, "solver", toConfig(registrar_options_), &registrar_options_);
  serve(&tracking_server_, "tracking", toConfig(tracker_options_), &tracker_options_);
}

}  // namespace xray_registration

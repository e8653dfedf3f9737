#include "ct_hand.h"

#include <ros/console.h>

#include <cstdio>
#include <utility>

#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

constexpr double kPeriod_s = 1.0 / 30.0;  // As often as rviz tells where the marker is.
constexpr std::size_t kFewest = 4;        // Pairs of which there may be a pose;
constexpr std::size_t kEnough = 6;        // of which wrong ones are found.

ros::NodeHandle withQueue(const ros::NodeHandle& node, ros::CallbackQueue* queue) {
  ros::NodeHandle result(node);
  result.setCallbackQueue(queue);
  return result;
}

}  // namespace

CtHand::CtHand(const Nodes& nodes, const NodeParameters& parameters, const Transforms* transforms,
               const Publishers* publishers, const LandmarkSolver* landmarks)
    : parameters_(parameters),
      transforms_(transforms),
      publishers_(publishers),
      solver_(landmarks),
      node_(withQueue(nodes.node, &queue_)),
      private_node_(withQueue(nodes.private_node, &queue_)) {}

CtHand::~CtHand() { stop(); }

void CtHand::serve(RegistrationWorker* worker, std::function<void()> reset,
                   const std::vector<std::string>& image_topics) {
  worker_ = worker;
  reset_ = std::move(reset);
  landmarks_publisher_ = private_node_.advertise<visualization_msgs::MarkerArray>("landmarks", 1, true);
  localize_ = std::make_unique<LocalizeClient>(private_node_);
  marker_ = std::make_unique<CtMarker>(private_node_.resolveName("ct_marker"), parameters_, transforms_, menuActions(),
                                       markerActions());
  subscribe(image_topics);
  offerService("use_landmarks", &CtHand::useLandmarks);
  offerService("clear_landmarks", &CtHand::clearLandmarks);
  timer_ = private_node_.createWallTimer(ros::WallDuration(kPeriod_s), [this](const ros::WallTimerEvent&) { work(); });
  spinner_ = std::make_unique<ros::AsyncSpinner>(1, &queue_);
  spinner_->start();
}

void CtHand::stop() {
  if (!spinner_) return;
  timer_.stop();
  spinner_->stop();
  spinner_.reset();
  for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
  for (ros::ServiceServer& service : services_) service.shutdown();
  marker_.reset();
  localize_.reset();
}

void CtHand::post(std::function<void()> job) {
  const std::lock_guard<std::mutex> lock(jobs_mutex_);
  jobs_.push_back(std::move(job));
}

void CtHand::work() {
  std::vector<std::function<void()>> jobs;
  {
    const std::lock_guard<std::mutex> lock(jobs_mutex_);
    jobs.swap(jobs_);
  }
  for (const auto& job : jobs) job();
  marker_->tick();
}

void CtHand::takeShapes(std::vector<ShownShape> shapes) {
  post([this, shapes = std::move(shapes)]() mutable {
    marker_->takeShapes(std::move(shapes));
    clearLandmarks();
  });
}

void CtHand::takeCamera(const std::string& camera_frame, const XrayCamera& camera) {
  post([this, camera_frame, camera] { marker_->takeCamera(camera_frame, camera); });
}

void CtHand::forgetPoses() {
  post([this] { marker_->forgetPoses(); });
}

void CtHand::takeResult(const RegistrationResult& result) {
  RegistrationResult poses;  // All that is looked at.
  poses.accepted = result.accepted;
  poses.T_camera_ct = result.T_camera_ct;
  poses.bodies = result.bodies;
  post([this, poses = std::move(poses)] { marker_->takeResult(poses); });
}

MarkerMenu::Actions CtHand::menuActions() {
  // On the marker server's thread.
  const auto later = [this](std::function<void()> job) { return [this, job = std::move(job)] { post(job); }; };
  MarkerMenu::Actions actions;
  actions.use_landmarks = later([this] {
    const std_srvs::Trigger::Response response = useLandmarks();
    if (response.success == 0) ROS_WARN_STREAM("landmarks: " << response.message);
  });
  actions.take_back_landmark = later([this] {
    clicked_.takeBack();
    landmarksChanged();
  });
  actions.clear_landmarks = later([this] { clearLandmarks(); });
  actions.localize_here = later([this] { localize_->start(marker_->ctPose(), marker_->cameraFrame()); });
  actions.localize_anywhere = later([this] { localize_->start(std::nullopt, ""); });
  actions.reset = later([this] { reset_(); });
  return actions;
}

CtMarker::Actions CtHand::markerActions() {
  CtMarker::Actions actions;
  actions.post = [this](std::function<void()> job) { post(std::move(job)); };
  actions.set_pose = [this](const RigidTransform& T_camera_object, const std::string& frame, const std::string& body) {
    worker_->setPose(T_camera_object, frame, body);
  };
  actions.preview = [this](const PreviewRequest& request) { return worker_->preview(request); };
  actions.moved_by_hand = [this](bool moved) { worker_->setMovedByHand(moved); };
  actions.show_surface = [this](const std::string& body, const TriangleMesh& mesh) {
    publishers_->surface(body, mesh);
  };
  return actions;
}

void CtHand::subscribe(const std::vector<std::string>& image_topics) {
  constexpr int kQueueSize = 10;
  subscribers_.push_back(node_.subscribe<geometry_msgs::PointStamped>(
      parameters_.clicks.point_topic, kQueueSize,
      [this](const geometry_msgs::PointStampedConstPtr& point) { takePoint(*point); }));
  const std::vector<std::string> views = parameters_.viewNames();
  for (std::size_t i = 0; i < views.size(); ++i) {
    subscribers_.push_back(node_.subscribe<geometry_msgs::Point>(
        image_topics[i] + parameters_.clicks.pixel_suffix, kQueueSize,
        [this, view = views[i]](const geometry_msgs::PointConstPtr& pixel) { takePixel(view, *pixel); }));
  }
}

void CtHand::takePoint(const geometry_msgs::PointStamped& point) {
  std::string why;
  const std::optional<Eigen::Vector3d> point_ct = marker_->pointInCt(point, &why);
  if (!point_ct) {
    ROS_WARN_STREAM("the clicked point is no point of the CT: " << why);
    return;
  }
  clicked_.addPoint(*point_ct);
  landmarksChanged();
}

void CtHand::takePixel(const std::string& view, const geometry_msgs::Point& pixel) {
  clicked_.addPixel(view, {pixel.x, pixel.y});
  landmarksChanged();
}

void CtHand::landmarksChanged() {
  ROS_INFO_STREAM("landmarks: " << clicked_.inWords());
  proposal_.reset();
  clicked_.judge({});
  marker_->withdraw();
  if (clicked_.pairCount() >= kFewest) proposePose();
  showLandmarks();
}

void CtHand::proposePose() {
  try {
    proposal_ = solver_->solve(clicked_.seen(), worker_->ctGrid());
  } catch (const std::exception& error) {
    ROS_WARN_STREAM("landmarks: no pose: " << error.what());
    return;
  }
  clicked_.judge(proposal_->pose.used);
  marker_->propose(proposal_->pose.T_first_ct);
  char text[160];
  std::snprintf(text, sizeof text, "%zu of %zu agree, %.1f px off (rms)", proposal_->pose.usedCount(),
                proposal_->pose.used.size(), proposal_->pose.rms_px);
  ROS_INFO_STREAM("landmarks: a pose is proposed: "
                  << text << "; ~use_landmarks or the menu of ~ct_marker makes it the start"
                  << (clicked_.pairCount() < kEnough ? ". From six on, wrong ones are found" : ""));
}

void CtHand::showLandmarks() {
  const std::vector<ShownLandmark> shown = clicked_.shown();
  visualization_msgs::MarkerArray message;
  visualization_msgs::Marker clear;
  clear.action = visualization_msgs::Marker::DELETEALL;
  message.markers.push_back(clear);
  for (visualization_msgs::Marker& marker : message.markers) marker.header.frame_id = parameters_.frames.ct;
  for (visualization_msgs::Marker& marker : landmarkMarkers(shown, Eigen::Vector3d::Zero())) {
    marker.header.frame_id = parameters_.frames.ct;
    marker.frame_locked = 1;
    message.markers.push_back(marker);
  }
  landmarks_publisher_.publish(message);
  marker_->showLandmarks(shown);
}

std_srvs::Trigger::Response CtHand::useLandmarks() {
  std_srvs::Trigger::Response response;
  if (!proposal_) {
    response.message = "the landmarks propose no pose: " + clicked_.inWords();
    return response;
  }
  worker_->setPose(proposal_->pose.T_first_ct, proposal_->frame_id);
  marker_->withdraw();
  ROS_INFO("landmarks: the next registration starts from their pose");
  response.success = 1;
  response.message = "taken";
  return response;
}

std_srvs::Trigger::Response CtHand::clearLandmarks() {
  clicked_.clear();
  proposal_.reset();
  marker_->withdraw();
  showLandmarks();
  std_srvs::Trigger::Response response;
  response.success = 1;
  return response;
}

void CtHand::offerService(const std::string& name, std_srvs::Trigger::Response (CtHand::*serve)()) {
  using Request = std_srvs::Trigger::Request;
  using Response = std_srvs::Trigger::Response;
  services_.push_back(private_node_.advertiseService<Request, Response>(
      name, boost::function<bool(Request&, Response&)>([this, serve](Request& /*request*/, Response& response) {
        response = (this->*serve)();
        return true;
      })));
}

}  // namespace xray_registration

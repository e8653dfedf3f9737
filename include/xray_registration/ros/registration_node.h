#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <image_transport/image_transport.h>
#include <image_transport/subscriber.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <ros/subscriber.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "xray_registration/AcceptConfig.h"
#include "xray_registration/Calibrate.h"
#include "xray_registration/LoadCt.h"
#include "xray_registration/RegisterLandmarks.h"
#include "xray_registration/SetInitialPose.h"
#include "xray_registration/SolverConfig.h"
#include "xray_registration/TrackingConfig.h"
#include "xray_registration/pipeline/clock_watch.h"
#include "xray_registration/pipeline/console_help.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/ros/image_gate.h"
#include "xray_registration/ros/master_watch.h"
#include "xray_registration/ros/registration_worker.h"
#include "xray_registration/ros/view_synchroniser.h"

namespace diagnostic_updater {
class Updater;
class DiagnosticStatusWrapper;
}  // namespace diagnostic_updater

namespace xray_registration {

class CtHand;
class LandmarkSolver;
class LocalizeServer;
template <typename Config>
class TuningServer;

/// The node's logger: rosconsole.
Logger rosLogger();

/// Subscriptions, services, live parameters and diagnostics around a RegistrationWorker; the same class in the node and
/// in the nodelet. It brings its own threads: one for images, two for services, the worker's; callbacks of the given
/// handles' queues are not used. The destructor ends them all, subscriptions first, the device last.
class RegistrationNode {
 public:
  /// `node` resolves the topics, `private_node` the parameters.
  /// @throws ParameterError
  RegistrationNode(const ros::NodeHandle& node, const ros::NodeHandle& private_node);
  ~RegistrationNode();
  RegistrationNode(const RegistrationNode&) = delete;
  RegistrationNode& operator=(const RegistrationNode&) = delete;

 private:
  // On the image thread.
  void nameInputs();
  void serveHand();
  void subscribe();
  void takeImage(std::size_t view, const sensor_msgs::ImageConstPtr& image);
  void watch();
  void followClock();

  // On the service threads.
  bool loadCt(LoadCt::Request& request, LoadCt::Response& response);
  bool calibrate(Calibrate::Request& request, Calibrate::Response& response);
  bool setInitialPose(SetInitialPose::Request& request, SetInitialPose::Response& response);
  bool registerLandmarks(RegisterLandmarks::Request& request, RegisterLandmarks::Response& response);
  bool reset(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool registerOnce(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool setEnabled(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  RegistrationWorker::Answer takePose(const std_msgs::Header& header, const geometry_msgs::Pose& pose,
                                      const std::string& body);
  void resetAll();
  void subscribePose(const std::string& topic, const ros::NodeHandle& node, const std::string& body);
  void advertiseServices();
  void serveTuning();
  void say(const std::string& error);
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const;
  void help();

  /// What came of one view; counted on the image thread, read by the others.
  struct Input {
    std::string image_topic;
    std::string info_topic;
    std::atomic<std::uint64_t> images{0};
    std::atomic<std::uint64_t> infos{0};
    std::atomic<int> image_publishers{0};
  };

  ros::CallbackQueue image_queue_;
  ros::CallbackQueue service_queue_;
  ros::NodeHandle image_node_;
  ros::NodeHandle service_node_;
  ros::NodeHandle private_node_;
  const NodeParameters parameters_;

  NodeStatistics statistics_;
  Publishers publishers_;
  Transforms transforms_;
  std::unique_ptr<LandmarkSolver> landmarks_;
  std::unique_ptr<CtHand> hand_;
  std::unique_ptr<PosePreview> preview_;
  std::unique_ptr<RegistrationWorker> worker_;
  ViewSynchroniser synchroniser_;
  ImageGate gate_;

  std::deque<Input> inputs_;  ///< In the order of the views.
  ConsoleHelp console_help_;
  std::vector<image_transport::Subscriber> image_subscribers_;
  std::vector<ros::Subscriber> info_subscribers_;
  std::vector<ros::Subscriber> pose_subscribers_;
  std::vector<ros::ServiceServer> services_;
  ros::WallTimer watch_timer_;
  ros::WallTimer diagnostics_timer_;
  ClockWatch clock_;
  bool resubscribe_ = false;

  std::mutex tuning_mutex_;
  RegistrarOptions registrar_options_;
  TrackerOptions tracker_options_;
  std::unique_ptr<TuningServer<AcceptConfig>> accept_server_;
  std::unique_ptr<TuningServer<SolverConfig>> solver_server_;
  std::unique_ptr<TuningServer<TrackingConfig>> tracking_server_;
  std::unique_ptr<diagnostic_updater::Updater> diagnostics_;

  std::unique_ptr<LocalizeServer> localize_server_;
  std::unique_ptr<MasterWatch> master_watch_;

  // Last: their threads end before anything that they use.
  std::unique_ptr<ros::AsyncSpinner> image_spinner_;
  std::unique_ptr<ros::AsyncSpinner> service_spinner_;
};

}  // namespace xray_registration

#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/PointStamped.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <std_srvs/Trigger.h>
#include <visualization_msgs/MarkerArray.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "clicked_points.h"
#include "ct_marker.h"
#include "landmark_solver.h"
#include "localize_client.h"
#include "xray_registration/ros/publishers.h"
#include "xray_registration/ros/registration_worker.h"

namespace xray_registration {

/// The hand on the CT: ~ct_marker, and landmarks that are clicked in rviz and in pictures of the X-rays. Has a thread
/// of its own, on which all of it runs; the worker's calls come from its threads and only leave word.
class CtHand : public ResultListener {
 public:
  struct Nodes {
    ros::NodeHandle node;          ///< Resolves clicked_point and the pictures' topics.
    ros::NodeHandle private_node;  ///< What is served.
  };

  /// Everything that is pointed to must outlive this.
  CtHand(const Nodes& nodes, const NodeParameters& parameters, const Transforms* transforms,
         const Publishers* publishers, const LandmarkSolver* landmarks);
  ~CtHand() override;
  CtHand(const CtHand&) = delete;
  CtHand& operator=(const CtHand&) = delete;

  /// To be called once, with the worker that tells this, and what ~reset does.
  /// @param image_topics  Of the views, in their order, resolved.
  void serve(RegistrationWorker* worker, std::function<void()> reset, const std::vector<std::string>& image_topics);
  /// Ends the thread and the marker; the worker is not called any more.
  void stop();

  void takeShapes(std::vector<ShownShape> shapes) override;
  void takeCamera(const std::string& camera_frame, const XrayCamera& camera) override;
  void forgetPoses() override;
  void takeResult(const RegistrationResult& result) override;

 private:
  void post(std::function<void()> job);
  void work();
  MarkerMenu::Actions menuActions();
  CtMarker::Actions markerActions();
  void subscribe(const std::vector<std::string>& image_topics);

  void takePoint(const geometry_msgs::PointStamped& point);
  void takePixel(const std::string& view, const geometry_msgs::Point& pixel);
  void landmarksChanged();
  void proposePose();
  void showLandmarks();
  std_srvs::Trigger::Response useLandmarks();
  std_srvs::Trigger::Response clearLandmarks();
  void offerService(const std::string& name, std_srvs::Trigger::Response (CtHand::*serve)());

  const NodeParameters& parameters_;
  const Transforms* transforms_;
  const Publishers* publishers_;
  const LandmarkSolver* solver_;
  RegistrationWorker* worker_ = nullptr;
  std::function<void()> reset_;

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::NodeHandle private_node_;
  std::mutex jobs_mutex_;
  std::vector<std::function<void()>> jobs_;

  // The hand's thread's own.
  std::unique_ptr<CtMarker> marker_;
  std::unique_ptr<LocalizeClient> localize_;
  ClickedPoints clicked_;
  std::optional<SolvedLandmarks> proposal_;
  ros::Publisher landmarks_publisher_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  ros::WallTimer timer_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;
};

}  // namespace xray_registration

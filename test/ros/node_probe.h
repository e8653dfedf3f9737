#pragma once

// Publishes to a running node and collects what it answers.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>
#include <xray_registration/LoadCt.h>
#include <xray_registration/RegistrationStatus.h>
#include <xray_registration/SetInitialPose.h>

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "scene.h"

namespace xray_registration {

/// Waits on the wall's clock; long enough for a slow machine, since only a failure waits this long.
inline bool waitFor(const std::function<bool()>& condition, double seconds = 30.0) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (!ros::ok() || std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

/// Messages of a topic, as they come.
template <typename Message>
class Messages {
 public:
  explicit Messages(const std::string& topic) {
    subscriber_ = node_.subscribe<Message>(topic, 1000, [this](const boost::shared_ptr<const Message>& message) {
      const std::lock_guard<std::mutex> lock(mutex_);
      messages_.push_back(*message);
    });
  }
  /// Those that came since it was last asked.
  std::vector<Message> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(messages_, {});
  }
  bool connected() const { return subscriber_.getNumPublishers() > 0; }

 private:
  ros::NodeHandle node_;
  std::mutex mutex_;
  std::vector<Message> messages_;
  ros::Subscriber subscriber_;
};

class NodeProbe {
 public:
  NodeProbe(const std::string& node, const std::vector<std::string>& views) : node_name_(node) {
    for (const std::string& view : views) {
      const std::string prefix = view.empty() ? "" : view + "/";
      images_.push_back(node_.advertise<sensor_msgs::Image>(prefix + "image_raw", 1000));
      infos_.push_back(node_.advertise<sensor_msgs::CameraInfo>(prefix + "camera_info", 1000));
    }
    status_ = node_.subscribe<RegistrationStatus>(node + "/status", 1000, [this](const auto& message) {
      const std::lock_guard<std::mutex> lock(mutex_);
      statuses_.push_back(*message);
    });
    pose_ =
        node_.subscribe<geometry_msgs::PoseWithCovarianceStamped>(node + "/pose", 1000, [this](const auto& message) {
          const std::lock_guard<std::mutex> lock(mutex_);
          poses_.push_back(*message);
        });
    tf_ = node_.subscribe<tf2_msgs::TFMessage>("/tf", 1000, [this](const auto& message) {
      const std::lock_guard<std::mutex> lock(mutex_);
      for (const auto& transform : message->transforms) {
        if (transform.child_frame_id == "ct" || transform.header.frame_id == "ct") transforms_.push_back(transform);
      }
    });
  }

  bool connected() {
    return waitFor([this] {
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (images_[i].getNumSubscribers() == 0 || infos_[i].getNumSubscribers() == 0) return false;
      }
      return status_.getNumPublishers() > 0 && pose_.getNumPublishers() > 0 && tf_.getNumPublishers() > 0;
    });
  }

  void publish(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info, std::size_t view = 0) {
    infos_[view].publish(info);
    images_[view].publish(image);
  }
  void publishImage(const sensor_msgs::Image& image) { images_[0].publish(image); }

  /// Services that take nothing, below the node's name.
  bool trigger(const std::string& service) {
    std_srvs::Trigger call;
    return ros::service::call(node_name_ + "/" + service, call) && call.response.success;
  }

  LoadCt::Response loadCt(const std::string& path) {
    LoadCt call;
    call.request.path = path;
    if (!ros::service::waitForService(node_name_ + "/load_ct", 30000) ||
        !ros::service::call(node_name_ + "/load_ct", call)) {
      call.response.message = "the call failed";
    }
    return call.response;
  }

  SetInitialPose::Response setPose(const RigidTransform& T_frame_ct, const std::string& frame_id) {
    SetInitialPose call;
    call.request.pose.header.frame_id = frame_id;
    call.request.pose.pose = toPose(T_frame_ct);
    if (!ros::service::call(node_name_ + "/set_initial_pose", call)) call.response.message = "the call failed";
    return call.response;
  }

  std::vector<RegistrationStatus> statuses(const ros::Time& stamp) const { return withStamp(statuses_, stamp); }
  std::size_t statusCount() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return statuses_.size();
  }
  std::vector<RegistrationStatus> allStatuses() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return statuses_;
  }
  std::vector<geometry_msgs::TransformStamped> transforms(const ros::Time& stamp) const {
    return withStamp(transforms_, stamp);
  }
  std::vector<geometry_msgs::PoseWithCovarianceStamped> poses(const ros::Time& stamp) const {
    return withStamp(poses_, stamp);
  }

  /// The status of the frame with this stamp; a status whose reason is "no status came" when none does.
  RegistrationStatus answer(const ros::Time& stamp, std::size_t number = 1) const {
    waitFor([&] { return statuses(stamp).size() >= number; });
    const std::vector<RegistrationStatus> found = statuses(stamp);
    if (found.size() < number) {
      RegistrationStatus none;
      none.reason = "no status came";
      return none;
    }
    return found.back();
  }

 private:
  template <typename Message>
  std::vector<Message> withStamp(const std::vector<Message>& messages, const ros::Time& stamp) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<Message> found;
    for (const Message& message : messages) {
      if (message.header.stamp == stamp) found.push_back(message);
    }
    return found;
  }

  std::string node_name_;
  ros::NodeHandle node_;
  std::vector<ros::Publisher> images_;
  std::vector<ros::Publisher> infos_;
  ros::Subscriber status_;
  ros::Subscriber pose_;
  ros::Subscriber tf_;
  mutable std::mutex mutex_;
  std::vector<RegistrationStatus> statuses_;
  std::vector<geometry_msgs::PoseWithCovarianceStamped> poses_;
  std::vector<geometry_msgs::TransformStamped> transforms_;
};

}  // namespace xray_registration

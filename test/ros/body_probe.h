#pragma once

// Sends frames in two views to a node that follows bodies, and collects what it says of them.

#include <sensor_msgs/image_encodings.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <visualization_msgs/Marker.h>

#include <map>

#include "body_scene.h"
#include "node_probe.h"

namespace xray_registration {

/// Newest message of a topic.
template <typename Message>
class Newest {
 public:
  explicit Newest(const std::string& topic) {
    subscriber_ = node_.subscribe<Message>(topic, 100, [this](const boost::shared_ptr<const Message>& message) {
      const std::lock_guard<std::mutex> lock(mutex_);
      message_ = message;
    });
  }
  boost::shared_ptr<const Message> get() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return message_;
  }
  bool hasStamp(const ros::Time& stamp) const {
    const auto message = get();
    return message && message->header.stamp == stamp;
  }
  bool connected() const { return subscriber_.getNumPublishers() > 0; }

 private:
  ros::NodeHandle node_;
  mutable std::mutex mutex_;
  boost::shared_ptr<const Message> message_;
  ros::Subscriber subscriber_;
};

class BodyProbe {
 public:
  /// `name_space`: of the node `registration` and of its images.
  BodyProbe(const std::string& name_space, const std::vector<std::string>& bodies)
      : name_space_(name_space), probe(name_space + "/registration", {name_space + "/front", name_space + "/side"}) {
    for (const std::string& body : bodies) {
      poses_[body] = std::make_unique<Newest<geometry_msgs::PoseWithCovarianceStamped>>(
          name_space + "/registration/bodies/" + body + "/pose");
    }
    tf_ = node_.subscribe<tf2_msgs::TFMessage>("/tf", 1000, [this](const auto& message) {
      const std::lock_guard<std::mutex> lock(mutex_);
      transforms_.insert(transforms_.end(), message->transforms.begin(), message->transforms.end());
    });
    geometry_msgs::TransformStamped side;
    side.header.frame_id = frame("front");
    side.header.stamp = ros::Time(1.0);
    side.child_frame_id = frame("side");
    side.transform = toTransform(TwoCameras::viewFromFirst(1).inverse());
    fixed_.sendTransform(side);
  }

  bool connected() {
    return probe.connected() && waitFor([this] {
             return std::all_of(poses_.begin(), poses_.end(),
                                [](const auto& pose) { return pose.second->connected(); });
           });
  }

  std::string frame(const std::string& view) const { return name_space_ + "_" + view; }

  /// One frame of what is posed in the first camera, and what the node answers.
  RegistrationStatus publish(const std::vector<PosedVolume>& parts) {
    stamp_ += ros::Duration(0.1);
    std::vector<sensor_msgs::Image> images;  // All are rendered before one is sent.
    for (std::size_t view = 0; view < 2; ++view) {
      images.push_back(cameras_.image(parts, view, stamp_, frame(view == 0 ? "front" : "side")));
    }
    for (std::size_t view = 0; view < 2; ++view) probe.publish(images[view], cameras_.info(images[view].header), view);
    return probe.answer(stamp_);
  }
  const ros::Time& stamp() const { return stamp_; }

  /// The transforms of the newest frame to a child; the status comes after them, but on another connection.
  std::vector<geometry_msgs::TransformStamped> transforms(const std::string& child) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<geometry_msgs::TransformStamped> found;
    for (const auto& transform : transforms_) {
      if (transform.header.stamp == stamp_ && transform.child_frame_id == child) found.push_back(transform);
    }
    return found;
  }
  bool hasTransform(const std::string& child) const {
    return waitFor([&] { return !transforms(child).empty(); }, 5.0);
  }
  bool hasPose(const std::string& body) const {
    return waitFor([&] { return poses_.at(body)->hasStamp(stamp_); }, 5.0);
  }
  boost::shared_ptr<const geometry_msgs::PoseWithCovarianceStamped> pose(const std::string& body) const {
    return poses_.at(body)->get();
  }

 private:
  std::string name_space_;
  ros::NodeHandle node_;
  TwoCameras cameras_;
  ros::Time stamp_{1000.0};
  std::map<std::string, std::unique_ptr<Newest<geometry_msgs::PoseWithCovarianceStamped>>> poses_;
  ros::Subscriber tf_;
  mutable std::mutex mutex_;
  std::vector<geometry_msgs::TransformStamped> transforms_;
  tf2_ros::StaticTransformBroadcaster fixed_;

 public:
  NodeProbe probe;
};

/// Pixels of a colour in a picture of the node's.
inline long countColour(const sensor_msgs::Image& image, const Rgb& colour) {
  long count = 0;
  for (std::size_t i = 0; i + 2 < image.data.size(); i += 3) {
    if (image.data[i] == colour[0] && image.data[i + 1] == colour[1] && image.data[i + 2] == colour[2]) ++count;
  }
  return count;
}

}  // namespace xray_registration

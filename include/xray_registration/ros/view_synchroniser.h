#pragma once

#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace xray_registration {

/// One view's part of a frame: an image with its calibration, or why one of them is missing.
struct ViewMessage {
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info;
  std::string problem;
  std::optional<double> held_for_s;  ///< For how long the same pixels have come; nothing for a new image.
};

/// What belongs to one instant, in the order of the views.
struct FrameMessages {
  std_msgs::Header header;  ///< Of the first view's image, or of the first one that is there.
  std::vector<ViewMessage> views;
  std::chrono::steady_clock::time_point arrived;  ///< Of the first of its images.
  bool complete() const;
};

/// Brings images and their CameraInfos together by exact stamp, and views by stamps that differ by no more than a
/// tolerance. Every image leaves it in exactly one frame, also when its CameraInfo or the other views never come: then
/// with the problem in words. Stamps within a view are expected to rise. No threads, no clock of its own.
class ViewSynchroniser {
 public:
  using Clock = std::chrono::steady_clock;
  using Callback = std::function<void(FrameMessages)>;

  struct Options {
    std::vector<std::string> views;  ///< One empty name for a single view.
    double tolerance_s = 0.02;
    /// How long a frame waits for what is missing, on the wall.
    std::chrono::milliseconds patience{250};
  };

  ViewSynchroniser(Options options, Callback on_frame);

  void addImage(std::size_t view, const sensor_msgs::ImageConstPtr& image, Clock::time_point now,
                const std::optional<double>& held_for_s = std::nullopt);
  void addInfo(std::size_t view, const sensor_msgs::CameraInfoConstPtr& info);

  /// Gives out what has waited longer than the patience. To be called every now and then.
  void expire(Clock::time_point now);

  /// Forgets everything that waits (a time jump).
  void clear();

 private:
  struct WaitingImage {
    sensor_msgs::ImageConstPtr image;
    Clock::time_point since;
    std::optional<double> held_for_s;
  };
  struct View {
    std::deque<WaitingImage> images;
    std::deque<sensor_msgs::CameraInfoConstPtr> infos;
  };
  struct WaitingFrame {
    ros::Time stamp;
    Clock::time_point since;
    std::vector<ViewMessage> views;
  };

  void ready(std::size_t view, ViewMessage message, Clock::time_point since);
  void dropUnpaired(std::size_t view, const ros::Time& before);
  void giveUpOldest(std::size_t view);
  void finish(WaitingFrame frame);
  bool canStillComplete(const WaitingFrame& frame, std::size_t view, const ros::Time& stamp) const;

  Options options_;
  Callback on_frame_;
  std::vector<View> views_;
  std::deque<WaitingFrame> frames_;  ///< By age.
};

}  // namespace xray_registration

#pragma once

#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/common/escaped.h"
#include "xray_registration/common/log.h"
#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// A bag that is no session, and why; the message names the file and the topic.
class BagSessionError : public EscapedError {
 public:
  using EscapedError::EscapedError;
};

/// One X-ray camera of a session: topics /<name>/image_raw, /<name>/camera_info and, if known, /<name>/ground_truth
/// and /<name>/ground_truth/<body>.
struct BagView {
  std::string name;                                          ///< Empty for topics without a prefix.
  std::string frame_id;                                      ///< Its X-ray optical frame, from the images' headers.
  RigidTransform T_view_first = RigidTransform::Identity();  ///< From /tf_static; maps points of the first view.
};

/// What one view has for one frame.
struct BagViewData {
  sensor_msgs::ImageConstPtr image;             ///< Null when the view has no image for this frame.
  sensor_msgs::CameraInfoConstPtr camera_info;  ///< Null when none has the image's stamp.
  std::optional<RigidTransform> T_camera_ct_true;
};

struct BagFrame {
  ros::Time stamp;                 ///< Of the first view's image, or of the first that there is.
  ros::Time received;              ///< When the last of its images was recorded.
  std::vector<BagViewData> views;  ///< In the order of BagSession::views().

  /// The CT in the first view's camera, from that view's ground truth or carried over from another's.
  std::optional<RigidTransform> T_first_ct_true;
  /// The same of bodies that move on their own, by name (/<view>/ground_truth/<body>).
  std::map<std::string, RigidTransform> T_first_bodies_true;
};

struct BagSessionOptions {
  std::vector<std::string> views;  ///< Empty: every topic that ends in /image_raw, in alphabetical order.
  double tolerance_s = 0.02;       ///< Largest difference of stamps between the views of one frame.
};

/// A recorded session: X-rays of one or several views, grouped into frames by their stamps. Of several images of a view
/// with one stamp the first recorded one counts. Images are read from the file when their frame is asked for. Not
/// thread-safe.
class BagSession {
 public:
  /// @throws BagSessionError when the file is not a bag or was not closed, has no images of a view, images without
  /// camera_info, or several views whose relative pose /tf_static does not give.
  explicit BagSession(const std::string& path, const BagSessionOptions& options = {}, const Logger& logger = {});
  ~BagSession();
  BagSession(const BagSession&) = delete;
  BagSession& operator=(const BagSession&) = delete;

  const std::string& path() const;
  const std::vector<BagView>& views() const;
  std::size_t frameCount() const;
  ros::Time stamp(std::size_t frame) const;

  /// @throws std::out_of_range, BagSessionError when the file cannot be read.
  BagFrame frame(std::size_t index) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// A pose of the CT as it was recorded.
struct StampedPose {
  std::string frame_id;
  ros::Time stamp;
  RigidTransform T_frame_ct;
};

/// The poses on a topic of PoseStamped or PoseWithCovarianceStamped, or of TFMessage, where the transforms to
/// `ct_frame` are taken; in the order of their recording, `limit` at most.
/// @throws BagSessionError when there is none, the topic has another type, or a pose is not rigid or not finite.
std::vector<StampedPose> readPoses(const std::string& bag_path, const std::string& topic, const std::string& ct_frame,
                                   std::size_t limit = std::numeric_limits<std::size_t>::max());

/// Whether anything was recorded on a topic. @throws BagSessionError when the file is not a bag.
bool hasTopic(const std::string& bag_path, const std::string& topic);

/// Writes a session that BagSession reads.
/// @throws BagSessionError when the file cannot be written.
class BagSessionWriter {
 public:
  explicit BagSessionWriter(const std::string& path);
  ~BagSessionWriter();
  BagSessionWriter(const BagSessionWriter&) = delete;
  BagSessionWriter& operator=(const BagSessionWriter&) = delete;

  /// The views' relative poses, on /tf_static; one view needs none.
  void writeViews(const std::vector<BagView>& views, const ros::Time& stamp);
  void writeImage(const BagView& view, const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& camera_info);
  void writeGroundTruth(const BagView& view, const ros::Time& stamp, const RigidTransform& T_camera_ct);
  void writeBodyGroundTruth(const BagView& view, const ros::Time& stamp, const std::string& body,
                            const RigidTransform& T_camera_body);
  void close();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace xray_registration

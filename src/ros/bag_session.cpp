#include "xray_registration/ros/bag_session.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2/buffer_core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bag_message.h"
#include "bag_structure.h"
#include "xray_registration/common/names.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

constexpr char kImageSuffix[] = "/image_raw";

std::string topicOf(const std::string& view, const std::string& name) {
  return view.empty() ? "/" + name : "/" + view + "/" + name;
}

std::string withoutOuterSlashes(std::string name) {
  while (!name.empty() && name.front() == '/') name.erase(0, 1);
  while (!name.empty() && name.back() == '/') name.pop_back();
  return name;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::unique_ptr<rosbag::Bag> openBag(const std::string& path) {
  if (const auto damage = bagDamage(path)) {
    throw BagSessionError(path + ": " + *damage + "; 'rosbag reindex " + path + "' may save what is whole");
  }
  auto bag = std::make_unique<rosbag::Bag>();
  try {
    bag->open(path, rosbag::bagmode::Read);
  } catch (const rosbag::BagUnindexedException&) {
    throw BagSessionError(path + ": has no index, since its recording was cut off before the bag was closed; mend it " +
                          "with 'rosbag reindex " + path + "'");
  } catch (const std::exception& error) {
    throw BagSessionError(path + ": cannot be read as a bag: " + error.what());
  }
  return bag;
}

/// Topic → data type.
std::map<std::string, std::string> topicsOf(rosbag::Bag& bag) {
  rosbag::View all(bag);
  std::map<std::string, std::string> types;
  for (const auto* connection : all.getConnections()) types[connection->topic] = connection->datatype;
  return types;
}

/// Names that ROS does not take are passed over: views' names become names of files.
std::vector<std::string> foundViews(const std::map<std::string, std::string>& topics) {
  std::vector<std::string> views;
  const std::string suffix = kImageSuffix;
  for (const auto& [topic, type] : topics) {
    if (type != "sensor_msgs/Image" || topic.size() < suffix.size()) continue;
    if (topic.compare(topic.size() - suffix.size(), suffix.size(), suffix) != 0) continue;
    const std::string name = withoutOuterSlashes(topic.substr(0, topic.size() - suffix.size()));
    if (name.empty() || isNamePath(name)) views.push_back(name);
  }
  return views;
}

/// One image of one view: where it stands in the file.
struct ImageEntry {
  ros::Time stamp;
  rosbag::MessageInstance message;
};

/// What one view has, by stamp.
struct ViewIndex {
  std::vector<ImageEntry> images;
  std::map<ros::Time, sensor_msgs::CameraInfoConstPtr> camera_infos;
  std::map<ros::Time, RigidTransform> poses;
  std::map<ros::Time, std::map<std::string, RigidTransform>> body_poses;
};

/// The images in the order of their stamps, the first of each stamp alone: a bag that was merged, or recorded from two
/// publishers, may hold every image twice. Images without a stamp all stay, so that each can be refused.
std::vector<ImageEntry> inOrderOfStamps(const std::vector<ImageEntry>& images) {
  // A message instance cannot be assigned, so pointers are sorted and the entries copied in their order.
  std::vector<const ImageEntry*> order;
  order.reserve(images.size());
  for (const auto& entry : images) order.push_back(&entry);
  std::stable_sort(order.begin(), order.end(),
                   [](const ImageEntry* a, const ImageEntry* b) { return a->stamp < b->stamp; });
  std::vector<ImageEntry> sorted;
  sorted.reserve(order.size());
  for (const auto* entry : order) {
    const bool repeated = !sorted.empty() && !entry->stamp.isZero() && entry->stamp == sorted.back().stamp;
    if (!repeated) sorted.push_back(*entry);
  }
  return sorted;
}

/// A frame: for each view the number of its image, or nothing.
struct FrameIndex {
  ros::Time stamp;
  std::vector<std::optional<std::size_t>> images;
};

/// Groups the images of all views: each image of the view that has the earliest one left opens a frame and takes the
/// nearest image of every other view within the tolerance.
std::vector<FrameIndex> groupedFrames(const std::vector<ViewIndex>& views, double tolerance_s) {
  std::vector<FrameIndex> frames;
  std::vector<std::size_t> next(views.size(), 0);
  for (;;) {
    std::optional<ros::Time> earliest;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (next[i] == views[i].images.size()) continue;
      const ros::Time stamp = views[i].images[next[i]].stamp;
      if (!earliest || stamp < *earliest) earliest = stamp;
    }
    if (!earliest) return frames;
    FrameIndex frame;
    frame.images.resize(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (next[i] == views[i].images.size()) continue;
      const ros::Time stamp = views[i].images[next[i]].stamp;
      // In double: the difference of two ros::Time throws when it leaves 32 bits, and a stamp may hold anything.
      if (stamp.toSec() - earliest->toSec() > tolerance_s) continue;
      if (frame.stamp.isZero()) frame.stamp = stamp;
      frame.images[i] = next[i]++;
    }
    frames.push_back(frame);
  }
}

}  // namespace

struct BagSession::Implementation {
  std::string path;
  std::unique_ptr<rosbag::Bag> bag;
  std::vector<std::unique_ptr<rosbag::View>> queries;  // The message instances refer to them.
  std::vector<BagView> views;
  std::vector<ViewIndex> indices;
  std::vector<FrameIndex> frames;

  void chooseViews(const std::vector<std::string>& wanted, const std::map<std::string, std::string>& topics);
  void indexView(std::size_t view, const std::map<std::string, std::string>& topics, const Logger& logger);
  void readRelativePoses();
};

void BagSession::Implementation::chooseViews(const std::vector<std::string>& wanted,
                                             const std::map<std::string, std::string>& topics) {
  const auto found = foundViews(topics);
  if (found.empty()) {
    throw BagSessionError(path + ": has no X-rays: no topic of sensor_msgs/Image ends in " + kImageSuffix);
  }
  for (const auto& name : wanted.empty() ? found : wanted) {
    BagView view;
    view.name = withoutOuterSlashes(name);
    if (std::find(found.begin(), found.end(), view.name) == found.end()) {
      throw BagSessionError(path + ": has no images on " + topicOf(view.name, "image_raw") +
                            "; views in it: " + joined(found));
    }
    for (const auto& other : views) {
      if (other.name == view.name) throw BagSessionError(path + ": view '" + view.name + "' is named twice");
    }
    views.push_back(view);
  }
}

void BagSession::Implementation::indexView(std::size_t number, const std::map<std::string, std::string>& topics,
                                           const Logger& logger) {
  BagView& view = views[number];
  ViewIndex& index = indices[number];
  const std::string info_topic = topicOf(view.name, "camera_info");
  const std::string pose_topic = topicOf(view.name, "ground_truth");
  const std::string body_topics = pose_topic + "/";
  std::vector<std::string> wanted = {topicOf(view.name, "image_raw"), info_topic, pose_topic};
  for (const auto& [topic, type] : topics) {
    const bool is_of_body = topic.compare(0, body_topics.size(), body_topics) == 0;
    if (is_of_body && isName(topic.substr(body_topics.size()))) wanted.push_back(topic);
  }
  queries.push_back(std::make_unique<rosbag::View>(*bag, rosbag::TopicQuery(wanted)));
  for (const rosbag::MessageInstance& message : *queries.back()) {
    if (const auto image = messageOf<sensor_msgs::Image>(message)) {
      index.images.push_back({image->header.stamp, message});
      if (view.frame_id.empty()) view.frame_id = tfFrame(image->header.frame_id);
    } else if (const auto info = messageOf<sensor_msgs::CameraInfo>(message)) {
      index.camera_infos[info->header.stamp] = info;
    } else if (const auto pose = messageOf<geometry_msgs::PoseStamped>(message)) {
      const std::string& topic = message.getTopic();
      const RigidTransform T = fromPose(pose->pose, topic);
      if (topic == pose_topic) {
        index.poses[pose->header.stamp] = T;
      } else {
        index.body_poses[pose->header.stamp][topic.substr(body_topics.size())] = T;
      }
    } else {
      log(logger, LogLevel::kWarning,
          path + ": " + message.getTopic() + " has type " + message.getDataType() +
              ", which is not the session's; left out");
    }
  }
  if (index.camera_infos.empty()) {
    throw BagSessionError(path + ": has no sensor_msgs/CameraInfo on " + info_topic +
                          "; without it the images' geometry is not known");
  }
  std::vector<ImageEntry> sorted = inOrderOfStamps(index.images);
  if (const std::size_t repeated = index.images.size() - sorted.size(); repeated > 0) {
    log(logger, LogLevel::kWarning,
        path + ": " + std::to_string(repeated) + " images on " + topicOf(view.name, "image_raw") +
            " have the stamp of an earlier one and are left out");
  }
  index.images.swap(sorted);
}

void BagSession::Implementation::readRelativePoses() {
  if (views.size() < 2) return;
  tf2::BufferCore transforms;
  rosbag::View query(*bag, rosbag::TopicQuery("/tf_static"));
  for (const rosbag::MessageInstance& message : query) {
    const auto transforms_message = messageOf<tf2_msgs::TFMessage>(message);
    if (!transforms_message) continue;
    for (const auto& transform : transforms_message->transforms) transforms.setTransform(transform, path, true);
  }
  for (std::size_t i = 1; i < views.size(); ++i) {
    try {
      const auto found = transforms.lookupTransform(views[i].frame_id, views[0].frame_id, ros::Time(0));
      views[i].T_view_first = fromTransform(found.transform, "/tf_static");
    } catch (const std::exception& error) {
      throw BagSessionError(path + ": /tf_static does not connect '" + views[0].frame_id + "' and '" +
                            views[i].frame_id + "' of the views '" + views[0].name + "' and '" + views[i].name + "' (" +
                            error.what() + "); record it, or use one view alone");
    }
  }
}

BagSession::BagSession(const std::string& path, const BagSessionOptions& options, const Logger& logger)
    : implementation_(std::make_unique<Implementation>()) {
  auto& self = *implementation_;
  self.path = path;
  self.bag = openBag(path);
  try {
    const std::map<std::string, std::string> topics = topicsOf(*self.bag);
    self.chooseViews(options.views, topics);
    self.indices.resize(self.views.size());
    for (std::size_t i = 0; i < self.views.size(); ++i) self.indexView(i, topics, logger);
    self.readRelativePoses();
  } catch (const BagSessionError&) {
    throw;
  } catch (const std::exception& error) {
    throw BagSessionError(path + ": " + error.what());
  }
  self.frames = groupedFrames(self.indices, options.tolerance_s);
}

BagSession::~BagSession() = default;

const std::string& BagSession::path() const { return implementation_->path; }
const std::vector<BagView>& BagSession::views() const { return implementation_->views; }
std::size_t BagSession::frameCount() const { return implementation_->frames.size(); }
ros::Time BagSession::stamp(std::size_t frame) const { return implementation_->frames.at(frame).stamp; }

BagFrame BagSession::frame(std::size_t index) const {
  const auto& self = *implementation_;
  const FrameIndex& entry = self.frames.at(index);
  BagFrame frame;
  frame.stamp = entry.stamp;
  frame.views.resize(self.views.size());
  for (std::size_t i = 0; i < self.views.size(); ++i) {
    if (!entry.images[i]) continue;
    BagViewData& view = frame.views[i];
    const ImageEntry& image = self.indices[i].images[*entry.images[i]];
    try {
      view.image = messageOf<sensor_msgs::Image>(image.message);
    } catch (const std::exception& error) {
      throw BagSessionError(self.path + ": " + image.message.getTopic() + ": " + error.what());
    }
    frame.received = std::max(frame.received, image.message.getTime());
    const auto info = self.indices[i].camera_infos.find(image.stamp);
    if (info != self.indices[i].camera_infos.end()) view.camera_info = info->second;
    const auto bodies = self.indices[i].body_poses.find(image.stamp);
    if (bodies != self.indices[i].body_poses.end()) {
      for (const auto& [name, T_camera_body] : bodies->second) {
        frame.T_first_bodies_true.emplace(name, self.views[i].T_view_first.inverse() * T_camera_body);
      }
    }
    const auto pose = self.indices[i].poses.find(image.stamp);
    if (pose == self.indices[i].poses.end()) continue;
    view.T_camera_ct_true = pose->second;
    if (!frame.T_first_ct_true) frame.T_first_ct_true = self.views[i].T_view_first.inverse() * pose->second;
  }
  return frame;
}

namespace {

/// Adds the poses that a message holds. False when it is of another type.
bool appendPoses(const rosbag::MessageInstance& message, const std::string& ct_frame, std::vector<StampedPose>* poses) {
  const std::string& topic = message.getTopic();
  const auto append = [poses](const std_msgs::Header& header, const RigidTransform& T_frame_ct) {
    poses->push_back({tfFrame(header.frame_id), header.stamp, T_frame_ct});
  };
  if (const auto stamped = messageOf<geometry_msgs::PoseStamped>(message)) {
    append(stamped->header, fromPose(stamped->pose, topic));
  } else if (const auto with_covariance = messageOf<geometry_msgs::PoseWithCovarianceStamped>(message)) {
    append(with_covariance->header, fromPose(with_covariance->pose.pose, topic));
  } else if (const auto transforms = messageOf<tf2_msgs::TFMessage>(message)) {
    for (const auto& transform : transforms->transforms) {
      if (tfFrame(transform.child_frame_id) != ct_frame) continue;
      append(transform.header, fromTransform(transform.transform, topic));
    }
  } else {
    return false;
  }
  return true;
}

}  // namespace

std::vector<StampedPose> readPoses(const std::string& bag_path, const std::string& topic, const std::string& ct_frame,
                                   std::size_t limit) {
  const auto bag = openBag(bag_path);
  std::vector<StampedPose> poses;
  for (const rosbag::MessageInstance& message : rosbag::View(*bag, rosbag::TopicQuery(topic))) {
    if (poses.size() >= limit) break;
    try {
      if (appendPoses(message, ct_frame, &poses)) continue;
    } catch (const std::exception& error) {
      throw BagSessionError(bag_path + ": " + error.what());
    }
    std::string problem = bag_path;
    problem.append(": ").append(topic).append(" has type ").append(message.getDataType());
    problem.append(", not geometry_msgs/PoseStamped, PoseWithCovarianceStamped or tf2_msgs/TFMessage");
    throw BagSessionError(problem);
  }
  if (poses.empty()) throw BagSessionError(bag_path + ": has no pose on " + topic);
  return poses;
}

bool hasTopic(const std::string& bag_path, const std::string& topic) {
  const auto bag = openBag(bag_path);
  return rosbag::View(*bag, rosbag::TopicQuery(topic)).size() > 0;
}

struct BagSessionWriter::Implementation {
  std::string path;
  rosbag::Bag bag;

  template <typename Message>
  void write(const std::string& topic, const ros::Time& stamp, const Message& message) {
    try {
      bag.write(topic, stamp, message);
    } catch (const std::exception& error) {
      throw BagSessionError(path + ": cannot be written: " + error.what());
    }
  }

  void writePose(const std::string& topic, const BagView& view, const ros::Time& stamp, const RigidTransform& pose) {
    geometry_msgs::PoseStamped message;
    message.header.stamp = stamp;
    message.header.frame_id = view.frame_id;
    message.pose = toPose(pose);
    write(topic, stamp, message);
  }
};

BagSessionWriter::BagSessionWriter(const std::string& path) : implementation_(std::make_unique<Implementation>()) {
  implementation_->path = path;
  try {
    implementation_->bag.open(path, rosbag::bagmode::Write);
    implementation_->bag.setCompression(rosbag::compression::LZ4);
  } catch (const std::exception& error) {
    throw BagSessionError(path + ": cannot be written: " + error.what());
  }
}

BagSessionWriter::~BagSessionWriter() = default;

void BagSessionWriter::writeViews(const std::vector<BagView>& views, const ros::Time& stamp) {
  tf2_msgs::TFMessage message;
  for (std::size_t i = 1; i < views.size(); ++i) {
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = stamp;
    transform.header.frame_id = views[0].frame_id;
    transform.child_frame_id = views[i].frame_id;
    transform.transform = toTransform(views[i].T_view_first.inverse());
    message.transforms.push_back(transform);
  }
  if (!message.transforms.empty()) implementation_->write("/tf_static", stamp, message);
}

void BagSessionWriter::writeImage(const BagView& view, const sensor_msgs::Image& image,
                                  const sensor_msgs::CameraInfo& camera_info) {
  implementation_->write(topicOf(view.name, "camera_info"), camera_info.header.stamp, camera_info);
  implementation_->write(topicOf(view.name, "image_raw"), image.header.stamp, image);
}

void BagSessionWriter::writeGroundTruth(const BagView& view, const ros::Time& stamp,
                                        const RigidTransform& T_camera_ct) {
  implementation_->writePose(topicOf(view.name, "ground_truth"), view, stamp, T_camera_ct);
}

void BagSessionWriter::writeBodyGroundTruth(const BagView& view, const ros::Time& stamp, const std::string& body,
                                            const RigidTransform& T_camera_body) {
  implementation_->writePose(topicOf(view.name, "ground_truth/" + body), view, stamp, T_camera_body);
}

void BagSessionWriter::close() {
  try {
    implementation_->bag.close();
  } catch (const std::exception& error) {
    throw BagSessionError(implementation_->path + ": cannot be written: " + error.what());
  }
}

}  // namespace xray_registration

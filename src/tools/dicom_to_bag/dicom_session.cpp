#include "tools/dicom_to_bag/dicom_session.h"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <rosbag/bag.h>
#include <sensor_msgs/image_encodings.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <stdexcept>

#include "tools/common/image_files.h"
#include "tools/common/session_messages.h"
#include "xray_registration/ros/bag_session.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration::tools {
namespace {

namespace fs = std::filesystem;

// How well angles and a patient on a table say where the CT is, one standard deviation.
constexpr double kTurned_rad = 0.1;
constexpr double kShifted_mm = 30.0;

std::string beside(const std::string& bag, const std::string& end) {
  return (fs::path(bag).parent_path() / (fs::path(bag).stem().string() + end)).string();
}

/// As mono8 or mono16 where pixels are whole numbers, else as floats.
sensor_msgs::Image imageMessageOf(const DicomView& view, const DicomPicture& picture, const DicomGeometry& geometry,
                                  const std::string& frame_id, const ros::Time& stamp) {
  const XrayDicomFile& file = view.run->files[picture.file];
  FloatImage pixels = file.frame(picture.frame, view.meaning.reversed);
  if (*geometry.mirrored.value) mirrorColumns(&pixels);
  sensor_msgs::Image message;
  if (!file.isIntegral()) {
    message = toFloatMessage(pixels);
    message.header.frame_id = frame_id;
    message.header.stamp = stamp;
    return message;
  }
  Image<std::uint16_t> whole(pixels.width, pixels.height);
  std::copy(pixels.pixels.begin(), pixels.pixels.end(), whole.pixels.begin());
  message = imageMessage(whole, frame_id, stamp);
  if (file.header().bits > 8 || file.fullScale() > 255.0) return message;
  message.encoding = sensor_msgs::image_encodings::MONO8;
  message.step = message.width;
  message.data.assign(whole.pixels.begin(), whole.pixels.end());
  return message;
}

/// The views' frames; their relative poses when all first pictures have one.
std::vector<BagView> bagViewsOf(const std::vector<DicomView>& views, bool* are_connected) {
  std::vector<BagView> all;
  const auto& first = views.front().geometry().T_camera_isocentre;
  *are_connected = true;
  for (const DicomView& view : views) {
    BagView bag_view{view.name(), view.name() + "_xray_optical"};
    const auto& own = view.geometry().T_camera_isocentre;
    if (first && own) {
      bag_view.T_view_first = *own * first->inverse();
    } else if (views.size() > 1) {
      *are_connected = false;
    }
    all.push_back(bag_view);
  }
  return all;
}

void writeImages(const DicomView& view, const BagView& bag_view, double first_stamp_s, BagSessionWriter* bag) {
  for (std::size_t i = 0; i < view.run->pictures.size(); ++i) {
    const DicomPicture& picture = view.run->pictures[i];
    const ros::Time stamp(first_stamp_s + picture.time_s);
    const DicomGeometry& geometry = view.geometries[i];
    if (!geometry.camera) throw std::runtime_error("picture " + std::to_string(i + 1) + " has no geometry");
    bag->writeImage(bag_view, imageMessageOf(view, picture, geometry, bag_view.frame_id, stamp),
                    cameraInfoMessage(*geometry.camera, bag_view.frame_id, stamp));
  }
}

void writeInitialPose(const BagView& view, const ros::Time& stamp, const RigidTransform& T_first_ct,
                      const Eigen::Vector3d& isocentre_ct_mm, rosbag::Bag* bag) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.frame_id = view.frame_id;
  message.header.stamp = stamp;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(kShifted_mm * kShifted_mm);
  covariance.diagonal().tail<3>().setConstant(kTurned_rad * kTurned_rad);
  message.pose = toPoseWithCovariance(T_first_ct, covariance, isocentre_ct_mm);
  bag->write("/initialpose", stamp, message);
}

void writePoses(const DicomView& view, const BagView& bag_view, const Eigen::Vector3d& isocentre_ct_mm,
                double first_stamp_s, rosbag::Bag* bag) {
  for (std::size_t i = 0; i < view.run->pictures.size(); ++i) {
    const auto T_camera_ct = cameraFromCt(view.geometries[i], isocentre_ct_mm);
    if (!T_camera_ct) continue;
    geometry_msgs::PoseStamped message;
    message.header.frame_id = bag_view.frame_id;
    message.header.stamp = ros::Time(first_stamp_s + view.run->pictures[i].time_s);
    message.pose = toPose(*T_camera_ct);
    bag->write("/" + bag_view.name + "/positioner_pose", message.header.stamp, message);
  }
}

/// The mask's file; empty when nothing is covered.
std::string writeMask(const std::string& bag, const DicomView& view) {
  if (view.mask.empty()) return "";
  std::string path = fs::absolute(beside(bag, "_" + view.name() + "_mask.png")).string();
  // OpenCV's type for pixels in memory has no read-only form.
  writePng(path, cv::Mat(view.mask.height, view.mask.width, CV_8U, const_cast<std::uint8_t*>(view.mask.pixels.data())));
  return path;
}

void emitPose(const RigidTransform& pose, YAML::Emitter* out) {
  const Eigen::Vector3d p = pose.translation() / 1000.0;
  const Eigen::Quaterniond q(pose.linear());
  *out << YAML::Key << "initial_pose" << YAML::Value << YAML::BeginMap;
  *out << YAML::Key << "position" << YAML::Value << YAML::Flow << std::vector<double>{p.x(), p.y(), p.z()};
  *out << YAML::Key << "orientation" << YAML::Value << YAML::Flow << std::vector<double>{q.x(), q.y(), q.z(), q.w()};
  *out << YAML::EndMap;
}

std::string writeConfig(const std::string& bag, const std::vector<DicomView>& views,
                        const std::optional<RigidTransform>& T_first_ct) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "image" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "kind" << YAML::Value << nameOf(views.front().kind);
  std::vector<std::pair<std::string, std::string>> masks;
  masks.reserve(views.size());
  for (const DicomView& view : views) masks.emplace_back(view.name(), writeMask(bag, view));
  if (masks.size() == 1) {
    if (!masks.front().second.empty()) out << YAML::Key << "mask" << YAML::Value << masks.front().second;
  } else {
    out << YAML::Key << "masks" << YAML::Value << YAML::BeginMap;
    for (const auto& [view, path] : masks) {
      if (!path.empty()) out << YAML::Key << view << YAML::Value << path;
    }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
  if (views.size() > 1) {
    out << YAML::Key << "views" << YAML::Value << YAML::Flow << YAML::BeginSeq;
    for (const DicomView& view : views) out << view.name();
    out << YAML::EndSeq;
  }
  if (T_first_ct) emitPose(*T_first_ct, &out);
  out << YAML::EndMap;
  std::string path = beside(bag, ".yaml");
  std::ofstream stream(path);
  stream << out.c_str() << '\n';
  if (!stream.flush()) throw std::runtime_error(path + ": cannot be written");
  return path;
}

void appendPoses(const std::string& path, const std::vector<DicomView>& views, const std::vector<BagView>& bag_views,
                 const std::optional<RigidTransform>& T_first_ct, const Eigen::Vector3d& isocentre_ct_mm,
                 double first_stamp_s) {
  rosbag::Bag bag(path, rosbag::bagmode::Append);
  if (T_first_ct) writeInitialPose(bag_views.front(), ros::Time(first_stamp_s), *T_first_ct, isocentre_ct_mm, &bag);
  for (std::size_t i = 0; i < views.size(); ++i)
    writePoses(views[i], bag_views[i], isocentre_ct_mm, first_stamp_s, &bag);
}

}  // namespace

WrittenSession writeDicomSession(const std::string& bag, const std::vector<DicomView>& views,
                                 const Eigen::Vector3d& isocentre_ct_mm, double first_stamp_s) {
  WrittenSession written;
  written.T_first_ct = cameraFromCt(views.front().geometry(), isocentre_ct_mm);
  const std::vector<BagView> bag_views = bagViewsOf(views, &written.views_are_connected);
  BagSessionWriter writer(bag);
  if (written.views_are_connected) writer.writeViews(bag_views, ros::Time(first_stamp_s));
  for (std::size_t i = 0; i < views.size(); ++i) writeImages(views[i], bag_views[i], first_stamp_s, &writer);
  writer.close();
  appendPoses(bag, views, bag_views, written.T_first_ct, isocentre_ct_mm, first_stamp_s);
  written.config = writeConfig(bag, views, written.T_first_ct);
  return written;
}

}  // namespace xray_registration::tools

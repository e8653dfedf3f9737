#include "tools/calibrate/session/calibrated_bag.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "tools/calibrate/session/told_session.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration::tools {
namespace {

using Transforms = std::vector<geometry_msgs::TransformStamped>;

std::string bare(const std::string& frame) {
  return frame.substr(std::min(frame.find_first_not_of('/'), frame.size()));
}

/// Whether a frame hangs below another.
bool isBelow(const Transforms& all, const std::string& frame, const std::string& above) {
  std::map<std::string, std::string> parents;
  for (const auto& one : all) parents[bare(one.child_frame_id)] = bare(one.header.frame_id);
  std::string at = frame;
  for (std::size_t i = 0; i <= parents.size(); ++i) {
    const auto parent = parents.find(at);
    if (parent == parents.end()) return false;
    at = parent->second;
    if (at == above) return true;
  }
  return false;
}

void correct(const CalibratedSessionView& view, const std::string& first_frame, Transforms* all) {
  const bool above_first = isBelow(*all, first_frame, view.bag.frame_id);
  // Points of the view as calibrated, in the view's frame as recorded.
  const RigidTransform T_recorded_found = view.bag.T_view_first * view.firstViewFromThis();
  for (auto& one : *all) {
    const RigidTransform T = fromTransform(one.transform, "/tf_static");
    if (above_first && bare(one.header.frame_id) == view.bag.frame_id) {
      one.transform = toTransform(T_recorded_found.inverse() * T);
    } else if (!above_first && bare(one.child_frame_id) == view.bag.frame_id) {
      one.transform = toTransform(T * T_recorded_found);
    }
  }
}

void setCalibration(const Calibration& found, sensor_msgs::CameraInfo* info) {
  std::copy(found.k.begin(), found.k.end(), info->K.begin());
  info->D = found.distortion;
  info->distortion_model = found.distortion_model;
  // R and P describe a rectified image, which X-rays have none of but the undistorted one: that keeps K.
  info->P = {found.k[0], 0, found.k[2], 0, 0, found.k[4], found.k[5], 0, 0, 0, 1, 0};
}

Transforms staticTransforms(rosbag::Bag& bag) {
  Transforms all;
  rosbag::View query(bag, rosbag::TopicQuery("/tf_static"));
  for (const rosbag::MessageInstance& message : query) {
    const auto transforms = message.instantiate<tf2_msgs::TFMessage>();
    if (transforms) all.insert(all.end(), transforms->transforms.begin(), transforms->transforms.end());
  }
  return all;
}

void copyBag(rosbag::Bag& input, const std::vector<CalibratedSessionView>& views, rosbag::Bag* output) {
  std::map<std::string, Calibration> infos;
  for (const auto& view : views) {
    infos[(view.bag.name.empty() ? "" : "/" + view.bag.name) + "/camera_info"] = view.calibration();
  }
  // Whether a view hangs above the first is seen in all messages together.
  const Transforms corrected = correctedTransforms(staticTransforms(input), views);
  std::size_t next = 0;
  rosbag::View all(input);
  for (const rosbag::MessageInstance& message : all) {
    const auto info = infos.find(message.getTopic());
    if (const auto recorded = message.instantiate<sensor_msgs::CameraInfo>(); recorded && info != infos.end()) {
      setCalibration(info->second, recorded.get());
      output->write(message.getTopic(), message.getTime(), *recorded, message.getConnectionHeader());
    } else if (const auto tf = message.instantiate<tf2_msgs::TFMessage>(); tf && message.getTopic() == "/tf_static") {
      for (auto& one : tf->transforms) one = corrected[next++];
      output->write(message.getTopic(), message.getTime(), *tf, message.getConnectionHeader());
    } else {
      output->write(message.getTopic(), message.getTime(), message, message.getConnectionHeader());
    }
  }
}

}  // namespace

Transforms correctedTransforms(Transforms all, const std::vector<CalibratedSessionView>& views) {
  for (std::size_t i = 1; i < views.size(); ++i) correct(views[i], views.front().bag.frame_id, &all);
  return all;
}

void writeCalibratedBag(const std::string& input, const std::string& output,
                        const std::vector<CalibratedSessionView>& views) {
  try {
    rosbag::Bag from(input, rosbag::bagmode::Read);
    rosbag::Bag to(output, rosbag::bagmode::Write);
    to.setCompression(rosbag::compression::LZ4);
    copyBag(from, views, &to);
    to.close();
  } catch (const std::exception& error) {
    throw std::runtime_error(output + ": cannot be written from " + input + ": " + error.what());
  }
}

}  // namespace xray_registration::tools

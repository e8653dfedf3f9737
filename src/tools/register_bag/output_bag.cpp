#include "tools/register_bag/output_bag.h"

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <utility>

#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/result_transforms.h"
#include "xray_registration/ros/status_message.h"

namespace xray_registration::tools {
namespace {

// As the launch files name the node.
const char* const kPoseTopic = "/xray_registration/pose";
const char* const kStatusTopic = "/xray_registration/status";
const std::string kBodies = "/xray_registration/bodies/";

bool isResult(const std::string& topic) {
  return topic == kPoseTopic || topic == kStatusTopic || topic.compare(0, kBodies.size(), kBodies) == 0;
}

/// Parent and child of the transforms that the results are.
std::vector<std::pair<std::string, std::string>> resultFrames(const std::string& camera_frame,
                                                              const NodeParameters& parameters) {
  const FrameParameters& frames = parameters.frames;
  std::vector<std::pair<std::string, std::string>> all = {{camera_frame, frames.ct}};
  if (frames.invert_tf) std::swap(all.front().first, all.front().second);
  for (const BodyParameters& body : parameters.bodies) all.emplace_back(camera_frame, body.frame);
  return all;
}

/// A message of /tf without the poses that an earlier run wrote.
tf2_msgs::TFMessage withoutResults(tf2_msgs::TFMessage message,
                                   const std::vector<std::pair<std::string, std::string>>& frames) {
  const auto is_result = [&frames](const geometry_msgs::TransformStamped& transform) {
    return std::find(frames.begin(), frames.end(),
                     std::make_pair(transform.header.frame_id, transform.child_frame_id)) != frames.end();
  };
  auto& all = message.transforms;
  all.erase(std::remove_if(all.begin(), all.end(), is_result), all.end());
  return message;
}

/// Everything but the results of an earlier run, which are replaced.
void copyInput(const std::string& input, const std::vector<std::pair<std::string, std::string>>& frames,
               rosbag::Bag* output) {
  rosbag::Bag bag(input, rosbag::bagmode::Read);
  rosbag::View all(bag);
  for (const rosbag::MessageInstance& message : all) {
    if (isResult(message.getTopic())) continue;
    const auto transforms =
        message.getTopic() == "/tf" ? message.instantiate<tf2_msgs::TFMessage>() : tf2_msgs::TFMessagePtr();
    if (!transforms) {
      output->write(message.getTopic(), message.getTime(), message, message.getConnectionHeader());
      continue;
    }
    const tf2_msgs::TFMessage kept = withoutResults(*transforms, frames);
    if (!kept.transforms.empty()) output->write("/tf", message.getTime(), kept, message.getConnectionHeader());
  }
}

/// Counts as the node does.
struct Counts {
  std::uint64_t received = 0;
  std::uint64_t registered = 0;
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;

  void add(const FrameOutcome& outcome) {
    ++received;
    if (outcome.registered) ++registered;
    (outcome.result.accepted ? accepted : refused) += 1;
  }
};

RegistrationStatus statusOf(const FrameRecord& record, const std_msgs::Header& header, const Counts& counts,
                            const RegistrationPipeline& pipeline) {
  RegistrationStatus status = statusMessage(record.outcome, header, pipeline.parameters().bodies);
  status.latency = record.outcome.total_ms * 1e-3;
  status.device = pipeline.deviceName();
  status.ct = pipeline.ctName();
  status.frames_received = counts.received;
  status.frames_registered = counts.registered;
  status.frames_accepted = counts.accepted;
  status.frames_refused = counts.refused;
  return status;
}

geometry_msgs::PoseWithCovarianceStamped poseMessage(const std_msgs::Header& header, const RigidTransform& T_camera_ct,
                                                     const Matrix6d& covariance, const Eigen::Vector3d& centre_mm) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header = header;
  message.pose = toPoseWithCovariance(T_camera_ct, covariance, centre_mm);
  return message;
}

/// Poses of what was accepted, and the transforms that belong to them in one message: they are of one stamp.
void writePoses(const FrameRecord& record, const std_msgs::Header& header, const RegistrationPipeline& pipeline,
                rosbag::Bag* output) {
  const RegistrationResult& result = record.outcome.result;
  const NodeParameters& parameters = pipeline.parameters();
  if (result.accepted) {
    output->write(kPoseTopic, record.received,
                  poseMessage(header, result.T_camera_ct, result.covariance, pipeline.centreCt()));
  }
  for (const BodyResult& body : result.bodies) {
    if (!body.accepted) continue;
    output->write(kBodies + body.name + "/pose", record.received,
                  poseMessage(header, body.T_camera_body, body.covariance, body.centre_ct_mm));
  }
  // Poses are written in the first view's frame, whatever frames/fixed is.
  FrameParameters frames = parameters.frames;
  frames.fixed.clear();
  tf2_msgs::TFMessage tf;
  tf.transforms = resultTransforms(header, result, RigidTransform::Identity(), frames, parameters.bodies);
  if (frames.publish_tf && !tf.transforms.empty()) output->write("/tf", record.received, tf);
}

}  // namespace

void writeOutputBag(const std::string& path, const BagSession& session, const std::vector<FrameRecord>& records,
                    const RegistrationPipeline& pipeline) {
  rosbag::Bag output(path, rosbag::bagmode::Write);
  output.setCompression(rosbag::compression::LZ4);
  const std::string& camera_frame = session.views().front().frame_id;
  copyInput(session.path(), resultFrames(camera_frame, pipeline.parameters()), &output);
  Counts counts;
  for (const FrameRecord& record : records) {
    std_msgs::Header header;
    header.stamp = record.stamp;
    header.frame_id = record.frame_id;
    counts.add(record.outcome);
    output.write(kStatusTopic, record.received, statusOf(record, header, counts, pipeline));
    writePoses(record, header, pipeline, &output);
  }
  output.close();
}

}  // namespace xray_registration::tools

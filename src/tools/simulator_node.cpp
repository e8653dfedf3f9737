// Publishes simulated X-rays of a CT or phantom that moves, with their true poses, at a set rate.
#include <geometry_msgs/PoseStamped.h>
#include <image_transport/image_transport.h>
#include <ros/ros.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/common/command_line.h"
#include "tools/common/ct_source.h"
#include "tools/common/node_help.h"
#include "tools/common/session_generator.h"
#include "tools/common/session_messages.h"
#include "xray_registration/ros/conversions.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

constexpr char kHelp[] =
    R"(A ROS node that publishes simulated X-rays of a CT or a phantom that moves, with their true poses, at a set rate.

Usage: rosrun xray_registration simulator_node [_<parameter>:=<value>...] [<topic>:=<other topic>...]
  --help, -h                    this

Topics, for each view: <view>/image_raw, <view>/camera_info, <view>/ground_truth; /tf_static where there are several.

Parameters                      default
  ct/path                                 a CT; without it a phantom is made
  phantom                       head      or pelvis
  phantom_spacing_mm            1.0
  views                         ap:0      names and angles in degrees, such as ap:0,lateral:90
  rate                          10        Hz
  image_size                    256       pixels
  detector_mm                   300       the detector's side
  source_detector_mm            1200
  source_centre_mm              800       from the source to the CT's centre
  amplitude_mm, amplitude_deg   10, 6     of the motion
  period                        6         s, of the motion
  instrument                    false     a rod and a ball of metal that stay with the camera
  seed                          1         of the motion and the noise
  physics/photons, physics/readout_noise, physics/scatter, physics/gain, physics/collimator_px
  ct/water_attenuation, ct/threshold_hu, ct/hu_slope, ct/hu_intercept, ct/unit_mm, ct/orientation, ct/check_values
                                          as the registration node's (docs/parameters.md)

The motion's first period is rendered before the first image is sent. Research use only.
)";

struct SimulatorParameters {
  CtSource ct;
  SessionSetup setup;
  double rate_hz = 10.0;
};

/// A number of any type that XML-RPC has; anything else is refused, not turned into the default.
void readNumber(const ros::NodeHandle& node, const std::string& name, double* value) {
  XmlRpc::XmlRpcValue given;
  if (!node.getParam(name, given)) return;
  if (given.getType() == XmlRpc::XmlRpcValue::TypeInt) {
    *value = static_cast<int>(given);
  } else if (given.getType() == XmlRpc::XmlRpcValue::TypeDouble) {
    *value = static_cast<double>(given);
  } else {
    throw ArgumentError("parameter " + node.resolveName(name) + " must be a number");
  }
}

template <typename Type>
void readExact(const ros::NodeHandle& node, const std::string& name, const char* kind, Type* value) {
  if (node.hasParam(name) && !node.getParam(name, *value)) {
    throw ArgumentError("parameter " + node.resolveName(name) + " must be " + kind);
  }
}

SimulatorParameters readParameters(const ros::NodeHandle& node) {
  SimulatorParameters parameters;
  SessionSetup& setup = parameters.setup;
  int seed = 1;
  std::string views = "ap:0";
  readExact(node, "ct/path", "text", &parameters.ct.path);
  if (parameters.ct.path.empty()) parameters.ct.phantom = "head";
  readNumber(node, "ct/hu_slope", &parameters.ct.read.hu_slope);
  readNumber(node, "ct/hu_intercept", &parameters.ct.read.hu_intercept);
  readNumber(node, "ct/unit_mm", &parameters.ct.read.unit_mm);
  readExact(node, "ct/orientation", "text", &parameters.ct.read.orientation);
  readExact(node, "ct/check_values", "true or false", &parameters.ct.read.check_values);
  readExact(node, "phantom", "text", &parameters.ct.phantom);
  readNumber(node, "phantom_spacing_mm", &parameters.ct.spacing_mm);
  readExact(node, "views", "text such as 'ap:0,lateral:90'", &views);
  readNumber(node, "rate", &parameters.rate_hz);
  readExact(node, "seed", "a whole number", &seed);
  readExact(node, "image_size", "a whole number", &setup.image_size);
  readNumber(node, "detector_mm", &setup.detector_mm);
  readNumber(node, "source_detector_mm", &setup.source_detector_mm);
  readNumber(node, "source_centre_mm", &setup.source_centre_mm);
  readNumber(node, "amplitude_mm", &setup.amplitude_mm);
  readNumber(node, "amplitude_deg", &setup.amplitude_deg);
  readNumber(node, "period", &setup.period_s);
  readExact(node, "instrument", "true or false", &setup.instrument);
  readNumber(node, "ct/water_attenuation", &setup.attenuation.water_per_mm);
  readNumber(node, "ct/threshold_hu", &setup.attenuation.threshold_hu);
  readNumber(node, "physics/photons", &setup.physics.photons_per_pixel);
  readNumber(node, "physics/readout_noise", &setup.physics.readout_noise);
  readNumber(node, "physics/scatter", &setup.physics.scatter_fraction);
  readNumber(node, "physics/gain", &setup.physics.gain);
  readNumber(node, "physics/collimator_px", &setup.physics.collimator_radius_px);
  setup.views = parseViews(views);
  setup.seed = static_cast<std::uint64_t>(seed);
  setup.check();
  if (!(parameters.rate_hz >= 0.01 && parameters.rate_hz <= 1000.0)) {
    throw ArgumentError("parameter " + node.resolveName("rate") + " is " + std::to_string(parameters.rate_hz) +
                        ": allowed are 0.01 to 1000");
  }
  const double loop_frames = parameters.rate_hz * setup.period_s;
  const double loop_bytes = loop_frames * 2.0 * setup.image_size * setup.image_size * setup.views.size();
  if (!(loop_bytes <= 2e9)) {
    throw ArgumentError("rate × period × image size come to " + std::to_string(loop_bytes / 1e9) +
                        " GB of images, which are kept in memory: allowed are 2 GB");
  }
  return parameters;
}

/// One period of the motion, rendered before the first image is sent: the rate then holds on any machine.
class Loop {
 public:
  Loop(const SessionGenerator& generator, double rate_hz)
      : frames_(static_cast<std::size_t>(std::max(1.0, std::round(rate_hz * generator.setup().period_s)))),
        views_(bagViews(generator)) {
    const double step_s = generator.setup().period_s / static_cast<double>(frames_.size());
    for (std::size_t i = 0; i < frames_.size() && ros::ok(); ++i) {
      ROS_INFO_THROTTLE(2.0, "rendering X-ray %zu of %zu", i + 1, frames_.size());
      const double time_s = step_s * static_cast<double>(i);
      for (std::size_t v = 0; v < views_.size(); ++v) {
        Frame frame;
        frame.image = imageMessage(generator.xray(v, i, time_s), views_[v].frame_id, {});
        frame.camera_info = cameraInfoMessage(generator.camera(), views_[v].frame_id, {});
        frame.pose.header.frame_id = views_[v].frame_id;
        frame.pose.pose = toPose(generator.cameraFromCt(v, time_s));
        frames_[i].push_back(std::move(frame));
      }
    }
  }

  struct Frame {
    sensor_msgs::Image image;
    sensor_msgs::CameraInfo camera_info;
    geometry_msgs::PoseStamped pose;
  };

  const std::vector<BagView>& views() const { return views_; }
  std::vector<Frame>& at(std::size_t number) { return frames_[number % frames_.size()]; }

 private:
  std::vector<std::vector<Frame>> frames_;
  std::vector<BagView> views_;
};

class Simulator {
 public:
  Simulator(ros::NodeHandle node, Loop loop) : loop_(std::move(loop)), transport_(node) {
    for (const BagView& view : loop_.views()) {
      cameras_.push_back(transport_.advertiseCamera(view.name + "/image_raw", 2));
      poses_.push_back(node.advertise<geometry_msgs::PoseStamped>(view.name + "/ground_truth", 10));
    }
    sendViews();
  }

  void publish(const ros::Time& stamp) {
    std::vector<Loop::Frame>& frame = loop_.at(number_++);
    for (std::size_t v = 0; v < frame.size(); ++v) {
      frame[v].pose.header.stamp = stamp;
      poses_[v].publish(frame[v].pose);  // Before the image, so that it is there when the result is.
      cameras_[v].publish(frame[v].image, frame[v].camera_info, stamp);
    }
  }

 private:
  void sendViews() {
    std::vector<geometry_msgs::TransformStamped> transforms;
    for (std::size_t v = 1; v < loop_.views().size(); ++v) {
      geometry_msgs::TransformStamped transform;
      transform.header.stamp = ros::Time::now();
      transform.header.frame_id = loop_.views()[0].frame_id;
      transform.child_frame_id = loop_.views()[v].frame_id;
      transform.transform = toTransform(loop_.views()[v].T_view_first.inverse());
      transforms.push_back(transform);
    }
    if (!transforms.empty()) broadcaster_.sendTransform(transforms);
  }

  Loop loop_;
  image_transport::ImageTransport transport_;
  std::vector<image_transport::CameraPublisher> cameras_;
  std::vector<ros::Publisher> poses_;
  tf2_ros::StaticTransformBroadcaster broadcaster_;
  std::size_t number_ = 0;
};

void run() {
  ros::NodeHandle node;  // Before all others: when the last handle goes, roscpp shuts down.
  const SimulatorParameters parameters = readParameters(ros::NodeHandle("~"));
  const Logger logger = [](LogLevel, const std::string& text) { ROS_INFO_STREAM(text); };
  const SessionGenerator generator(loadCt(parameters.ct, logger), parameters.setup);
  Loop loop(generator, parameters.rate_hz);
  if (!ros::ok()) return;
  Simulator simulator(node, std::move(loop));
  ROS_INFO("publishing %zu view(s) at %.1f Hz", parameters.setup.views.size(), parameters.rate_hz);
  const ros::Timer timer = node.createTimer(ros::Duration(1.0 / parameters.rate_hz),
                                            [&](const ros::TimerEvent&) { simulator.publish(ros::Time::now()); });
  ros::spin();
}

}  // namespace

int main(int argc, char** argv) {
  if (saidHelp(argc, argv, kHelp)) return kDone;
  ros::init(argc, argv, "xray_simulator");
  try {
    run();
  } catch (const ArgumentError& error) {
    ROS_FATAL("%s", error.what());
    return kWrongArguments;
  } catch (const std::exception& error) {
    ROS_FATAL("%s", error.what());
    return kWorkFailed;
  }
  return kDone;
}

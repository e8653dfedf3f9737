// Watches a registration whose truth is known: gives it a start, shows a live table, and ends with a verdict and
// pictures.
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <xray_registration/RegistrationStatus.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>

#include "tools/common/command_line.h"
#include "tools/common/disturbance.h"
#include "tools/common/image_files.h"
#include "tools/common/message_files.h"
#include "xray_registration/common/statistics.h"
#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/registration/tracker.h"
#include "xray_registration/ros/conversions.h"
#include "xray_registration/volume/attenuation.h"
#include "xray_registration/volume/volume_io.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;
using Clock = std::chrono::steady_clock;

struct Arguments {
  std::string ct;
  std::string view;
  std::string node = "xray_registration";
  std::string output = ".";
  double seconds = 20.0;
  double wait_s = 120.0;
  std::string disturb = "2,3";
  std::uint64_t seed = 1;
  double max_inplane_mm = 1.0;
  double max_mtre_mm = 5.0;
};

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Bones bright, as radiographs are looked at: the logarithm of what was let through, reversed.
FloatImage asOnFilm(FloatImage transmission) {
  for (float& value : transmission.pixels) value = -std::log(std::max(value, 1.0F));
  return transmission;
}

const char* stateName(std::uint8_t state) { return toString(static_cast<TrackingState>(state)); }

/// Listens to the simulator and the node; everything runs on the thread that spins.
class Monitor {
 public:
  Monitor(const Arguments& arguments, const Eigen::Vector3d& centre_ct_mm)
      : arguments_(arguments), centre_ct_mm_(centre_ct_mm), targets_(targetGrid(centre_ct_mm, 100.0)) {
    const std::string prefix = arguments.view.empty() ? "" : arguments.view + "/";
    truth_ = node_.subscribe(prefix + "ground_truth", 100, &Monitor::onTruth, this);
    status_ = node_.subscribe(arguments.node + "/status", 100, &Monitor::onStatus, this);
    start_ = node_.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 1);
  }

  /// False when the simulator or the node has ended since they were seen.
  bool bothAlive() const { return truth_.getNumPublishers() > 0 && status_.getNumPublishers() > 0; }
  bool hasStatus() const { return last_.has_value(); }
  bool isTracking() const { return last_ && last_->state == RegistrationStatus::TRACKING; }
  bool waitsForPose() const { return last_ && last_->state == RegistrationStatus::WAITING_FOR_POSE; }
  const std::optional<RegistrationStatus>& last() const { return last_; }

  /// Gives the node the newest true pose, disturbed, once somebody listens.
  void sendStart() {
    if (!newest_truth_ || start_.getNumSubscribers() == 0) return;
    const RigidTransform T_camera_ct =
        disturbedPose(fromPose(newest_truth_->pose), arguments_.disturb, arguments_.seed, centre_ct_mm_);
    geometry_msgs::PoseWithCovarianceStamped message;
    message.header = newest_truth_->header;
    message.pose.pose = toPose(T_camera_ct);
    start_.publish(message);
  }

  void listenForPictures() {
    const std::string prefix = arguments_.view.empty() ? "" : arguments_.view + "/";
    picture_subscribers_ = {subscribePicture(prefix + "image_raw", "xray"),
                            subscribePicture(arguments_.node + "/drr", "drr"),
                            subscribePicture(arguments_.node + "/overlay", "overlay")};
  }
  /// The newest X-ray whose DRR and overlay have come, and these.
  std::map<std::string, sensor_msgs::ImageConstPtr> pictures() const {
    if (pictures_.size() < 3) return {};
    const auto& overlays = pictures_.at("overlay");
    for (auto overlay = overlays.rbegin(); overlay != overlays.rend(); ++overlay) {
      std::map<std::string, sensor_msgs::ImageConstPtr> found;
      for (const auto& [name, images] : pictures_) {
        const auto image = images.find(overlay->first);
        if (image != images.end()) found[name] = image->second;
      }
      if (found.size() == 3) return found;
    }
    return {};
  }

  std::vector<std::string> writePictures() const {
    std::vector<std::string> paths;
    for (const auto& [name, image] : pictures()) {
      paths.push_back(std::filesystem::absolute(arguments_.output + "/" + name + ".png").lexically_normal());
      if (name == "xray") {
        writeGreyPng(paths.back(), asOnFilm(floatsOf(rawImage(*image).pixels)));
      } else {
        writePng(paths.back(), *image);
      }
    }
    return paths;
  }

  /// The newest frame that was registered; when there was none since the last row, the newest of all.
  void printRow() {
    const std::optional<RegistrationStatus> row = registered_ ? std::move(registered_) : last_;
    registered_.reset();
    if (!row) return;
    const auto error = errors_.find(row->header.stamp);
    char text[64] = "       -          -";
    if (error != errors_.end()) {
      std::snprintf(text, sizeof text, "%8.2f   %8.2f", error->second.mtre_mm, error->second.inplane_mm);
    }
    std::printf("%14.3f  %-16s %s   %10.3f  %7.1f  %s\n", row->header.stamp.toSec(), stateName(row->state), text,
                row->similarity, 1000.0 * row->solve_time, row->reason.c_str());
    std::fflush(stdout);
  }

  std::vector<PoseError> acceptedErrors() const {
    std::vector<PoseError> errors;
    for (const auto& [stamp, error] : errors_) errors.push_back(error);
    return errors;
  }
  const std::vector<double>& solveTimes() const { return solve_ms_; }
  std::size_t judged() const { return judged_; }
  std::size_t accepted() const { return accepted_; }

 private:
  ros::Subscriber subscribePicture(const std::string& topic, const std::string& name) {
    return node_.subscribe<sensor_msgs::Image>(topic, 5, [this, name](const sensor_msgs::ImageConstPtr& image) {
      auto& images = pictures_[name];
      images[image->header.stamp] = image;
      constexpr std::size_t kKept = 100;
      if (images.size() > kKept) images.erase(images.begin());
    });
  }

  void onTruth(const geometry_msgs::PoseStampedConstPtr& pose) {
    newest_truth_ = pose;
    truths_[pose->header.stamp] = fromPose(pose->pose);
    constexpr std::size_t kKept = 2000;
    if (truths_.size() > kKept) truths_.erase(truths_.begin());
  }

  void onStatus(const RegistrationStatusConstPtr& status) {
    last_ = *status;
    if (!status->registered) return;
    registered_ = *status;
    ++judged_;
    solve_ms_.push_back(1000.0 * status->solve_time);
    if (!status->accepted) return;
    ++accepted_;
    const auto truth = truths_.find(status->header.stamp);
    if (truth == truths_.end()) return;
    errors_[status->header.stamp] = poseError(fromPose(status->pose), truth->second, targets_);
  }

  Arguments arguments_;
  Eigen::Vector3d centre_ct_mm_;
  std::vector<Eigen::Vector3d> targets_;
  ros::NodeHandle node_;
  ros::Subscriber truth_;
  ros::Subscriber status_;
  ros::Publisher start_;
  std::vector<ros::Subscriber> picture_subscribers_;
  std::map<std::string, std::map<ros::Time, sensor_msgs::ImageConstPtr>> pictures_;
  geometry_msgs::PoseStampedConstPtr newest_truth_;
  std::map<ros::Time, RigidTransform> truths_;
  std::map<ros::Time, PoseError> errors_;
  std::optional<RegistrationStatus> last_;
  std::optional<RegistrationStatus> registered_;  ///< Not shown yet.
  std::vector<double> solve_ms_;
  std::size_t judged_ = 0;
  std::size_t accepted_ = 0;
};

/// Handles callbacks for a short while. @throws std::runtime_error when the other side has gone.
void listen() {
  ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.02));
  if (!ros::ok()) throw std::runtime_error("interrupted");
}

void requireMaster() {
  if (!ros::master::check()) throw std::runtime_error("the ROS master has gone, and simulator and node with it");
}

/// Gives the start until the node tracks.
void waitForTracking(const Arguments& arguments, Monitor* monitor) {
  const auto begin = Clock::now();
  auto next_try = begin;
  while (!monitor->isTracking()) {
    listen();
    if (secondsSince(begin) > arguments.wait_s) {
      std::string why = "no status from the node";
      if (monitor->hasStatus()) {
        why = std::string("its state is ") + stateName(monitor->last()->state) + ": " + monitor->last()->reason;
      }
      throw std::runtime_error("the node did not track within " + std::to_string(static_cast<int>(arguments.wait_s)) +
                               " s; " + why);
    }
    if (Clock::now() < next_try) continue;
    next_try = Clock::now() + std::chrono::seconds(1);
    requireMaster();
    if (monitor->hasStatus()) monitor->sendStart();
  }
}

void showTable(const Arguments& arguments, Monitor* monitor) {
  std::printf("%14s  %-16s %8s   %8s   %10s  %7s\n", "stamp", "state", "mTRE mm", "in-plane", "similarity", "ms");
  const auto begin = Clock::now();
  auto next_row = begin;
  bool pictures = false;
  while (secondsSince(begin) < arguments.seconds) {
    listen();
    // The node draws only for listeners, so the table shows its speed without them until shortly before the end.
    if (!pictures && secondsSince(begin) > arguments.seconds - 2.0) {
      monitor->listenForPictures();
      pictures = true;
    }
    if (Clock::now() < next_row) continue;
    next_row = Clock::now() + std::chrono::milliseconds(500);
    if (!monitor->bothAlive()) throw std::runtime_error("the simulator or the node ended");
    monitor->printRow();
  }
  for (const auto end = Clock::now(); monitor->pictures().empty() && secondsSince(end) < 10.0;) listen();
}

/// Prints the summary. @throws std::runtime_error when tracking failed.
void summarise(const Arguments& arguments, const Monitor& monitor) {
  std::vector<double> mtre, inplane;
  for (const PoseError& error : monitor.acceptedErrors()) {
    mtre.push_back(error.mtre_mm);
    inplane.push_back(error.inplane_mm);
  }
  std::printf("\n%zu of %zu registered frames accepted on %s, median %.1f ms a frame\n", monitor.accepted(),
              monitor.judged(), monitor.last()->device.c_str(), median(monitor.solveTimes()));
  std::printf("frames received %lu, dropped for newer ones %lu\n",
              static_cast<unsigned long>(monitor.last()->frames_received),
              static_cast<unsigned long>(monitor.last()->frames_dropped));
  if (mtre.empty()) throw std::runtime_error("tracking failed: no accepted frame has a true pose to compare with");
  std::printf("error against the truth: mTRE median %.2f mm, worst %.2f mm; in-plane median %.2f mm, worst %.2f mm\n",
              median(mtre), largest(mtre), median(inplane), largest(inplane));
  for (const std::string& path : monitor.writePictures()) std::printf("%s\n", path.c_str());

  if (!monitor.isTracking()) throw std::runtime_error("tracking failed: the node ended without a pose");
  if (monitor.accepted() * 10 < monitor.judged() * 8) throw std::runtime_error("tracking failed: too many refusals");
  if (median(inplane) > arguments.max_inplane_mm || median(mtre) > arguments.max_mtre_mm) {
    throw std::runtime_error("tracking failed: the poses are too far from the truth");
  }
  if (monitor.pictures().empty()) throw std::runtime_error("the node sent no DRR or overlay");
}

void run(const Arguments& arguments) {
  disturbedPose(RigidTransform::Identity(), arguments.disturb, arguments.seed, Eigen::Vector3d::Zero());
  std::filesystem::create_directories(arguments.output);
  const AttenuationVolume ct = toAttenuation(readVolume(arguments.ct, {}, {}), {});
  Monitor monitor(arguments, anatomicalCentreCt(ct));
  waitForTracking(arguments, &monitor);
  showTable(arguments, &monitor);
  summarise(arguments, monitor);
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "demo_monitor", ros::init_options::AnonymousName | ros::init_options::NoRosout);
  Arguments arguments;
  CLI::App app("Starts and watches a live registration of simulated X-rays; exit code 1 when tracking failed.",
               "demo_monitor");
  app.add_option("--ct", arguments.ct, "the CT that is registered")->required()->check(CLI::ExistingPath);
  app.add_option("--view", arguments.view, "name of the simulated view; its topics are <view>/image_raw, …");
  app.add_option("--node", arguments.node, "name of the registration node")->capture_default_str();
  app.add_option("--output", arguments.output, "folder for the pictures")->capture_default_str();
  app.add_option("--seconds", arguments.seconds, "how long the table runs")->capture_default_str();
  app.add_option("--wait", arguments.wait_s, "how long to wait for the first tracked frame, s")->capture_default_str();
  app.add_option("--disturb", arguments.disturb, "DEG,MM: the start's distance from the truth")->capture_default_str();
  app.add_option("--seed", arguments.seed, "direction of the disturbance")->capture_default_str();
  return runTool(app, argc, argv, [&] { run(arguments); });
}

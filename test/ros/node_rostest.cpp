// One view through a running node or nodelet: loads, tracks, refuses, recovers. Each case runs by itself, in any order:
// `rostest xray_registration node.test filter:=Node.FollowsTheHead`.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <rosgraph_msgs/Log.h>
#include <std_srvs/SetBool.h>
#include <sys/stat.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <unistd.h>
#include <visualization_msgs/Marker.h>

#include <atomic>
#include <fstream>
#include <future>
#include <memory>

#include "node_probe.h"

namespace xray_registration {
namespace {

const char* const kFrame = "xray_optical";

class Node : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>("node_" + std::to_string(ros::WallTime::now().toNSec()));
    probe_ = std::make_unique<NodeProbe>("registration", std::vector<std::string>{""});
    ASSERT_TRUE(probe_->connected());
    const LoadCt::Response loaded = probe_->loadCt(scene_->ctPath());
    ASSERT_TRUE(loaded.success) << loaded.message;
  }
  static void TearDownTestSuite() {
    probe_.reset();
    scene_.reset();
  }

  void SetUp() override {
    ASSERT_TRUE(probe_->trigger("reset"));
    statuses_before_ = probe_->statusCount();
  }
  /// Whatever happened: every answer holds numbers, and a reason exactly when it is not accepted.
  void TearDown() override {
    const std::vector<RegistrationStatus> all = probe_->allStatuses();
    for (std::size_t i = statuses_before_; i < all.size(); ++i) {
      const RegistrationStatus& status = all[i];
      for (const double value :
           {status.similarity, status.residual, status.inlier_fraction, status.condition_number, status.pose.position.x,
            status.pose.position.z, status.pose.orientation.w, status.latency, status.solve_time}) {
        EXPECT_TRUE(std::isfinite(value));
      }
      EXPECT_EQ(status.accepted != 0, status.reason.empty()) << status.reason;
      EXPECT_LE(status.accepted, status.registered);
    }
  }

  /// Publishes the head at a pose; every call has a new stamp, 0.1 s after the last.
  static ros::Time publish(const RigidTransform& pose) {
    const sensor_msgs::Image image = scene_->image(pose, nextStamp(), kFrame);
    probe_->publish(image, scene_->info(image.header));
    return image.header.stamp;
  }
  static ros::Time nextStamp() {
    stamp_ += ros::Duration(0.1);
    return stamp_;
  }
  static void expectAccepted(const ros::Time& stamp, const RigidTransform& truth) {
    const RegistrationStatus status = probe_->answer(stamp);
    ASSERT_TRUE(status.accepted) << status.reason;
    const PoseError error = scene_->error(fromPose(status.pose), truth);
    EXPECT_LT(error.inplane_mm, kInplaneTolerance);
    EXPECT_LT(error.mtre_mm, kMtreTolerance);
  }
  static void expectRefused(const ros::Time& stamp, const std::string& word) {
    const RegistrationStatus status = probe_->answer(stamp);
    EXPECT_FALSE(status.accepted);
    EXPECT_NE(status.reason, "no status came");
    EXPECT_NE(status.reason.find(word), std::string::npos) << status.reason;
    EXPECT_TRUE(probe_->transforms(stamp).empty());
    EXPECT_TRUE(probe_->poses(stamp).empty());
  }
  static void startAt(const RigidTransform& truth) {
    const SetInitialPose::Response response = probe_->setPose(scene_->disturbed(truth), kFrame);
    ASSERT_TRUE(response.success) << response.message;
  }
  /// Afterwards the node tracks the head at pose `number`.
  static void track(int number) {
    ASSERT_NO_FATAL_FAILURE(startAt(scene_->pose(number)));
    ASSERT_NO_FATAL_FAILURE(expectAccepted(publish(scene_->pose(number)), scene_->pose(number)));
  }
  /// Turned by 40° about the vertical: nothing that tracking from pose 0 may accept.
  static RigidTransform elsewhere() {
    Twist turn;
    turn << 0.0, 0.0, 0.0, 0.0, 0.7, 0.0;
    return updatedPose(scene_->pose(0), turn, scene_->pose(0) * scene_->centreCt());
  }

  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<NodeProbe> probe_;
  static ros::Time stamp_;
  std::size_t statuses_before_ = 0;
};

std::unique_ptr<Scene> Node::scene_;
std::unique_ptr<NodeProbe> Node::probe_;
ros::Time Node::stamp_{1000.0};

TEST_F(Node, SaysWhyACtCannotBeLoaded) {
  const LoadCt::Response response = probe_->loadCt("/nowhere/head.nii.gz");
  EXPECT_FALSE(response.success);
  EXPECT_NE(response.message.find("/nowhere/head.nii.gz"), std::string::npos) << response.message;
  EXPECT_FALSE(probe_->loadCt("").success);
}

TEST_F(Node, LoadsACtWhileFramesArrive) {
  std::atomic<bool> done{false};
  std::vector<ros::Time> stamps;
  const sensor_msgs::Image image = scene_->image(scene_->pose(0), ros::Time(1.0), kFrame);
  std::thread camera([&] {
    sensor_msgs::Image frame = image;
    while (!done && ros::ok()) {
      frame.header.stamp = nextStamp();
      probe_->publish(frame, scene_->info(frame.header));
      stamps.push_back(frame.header.stamp);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  const LoadCt::Response response = probe_->loadCt(scene_->ctPath());
  done = true;
  camera.join();
  ASSERT_TRUE(response.success) << response.message;
  for (const ros::Time& stamp : stamps) {
    const RegistrationStatus status = probe_->answer(stamp);
    EXPECT_FALSE(status.accepted);
    EXPECT_NE(status.reason, "no status came");
    EXPECT_EQ(probe_->statuses(stamp).size(), 1U);
  }
}

/// Describes a CT whose voxels come through a pipe: it is being read until somebody writes there.
class SlowCt {
 public:
  SlowCt() {
    std::filesystem::create_directories(folder_);
    std::ofstream(path()) << "NRRD0004\ntype: short\ndimension: 3\nsizes: 8 8 8\nencoding: raw\nendian: little\n"
                          << "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
                          << "space origin: (0,0,0)\ndata file: voxels.raw\n\n";
    EXPECT_EQ(mkfifo((folder_ / "voxels.raw").c_str(), 0600), 0);
  }
  ~SlowCt() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  SlowCt(const SlowCt&) = delete;
  SlowCt& operator=(const SlowCt&) = delete;

  std::string path() const { return (folder_ / "slow.nhdr").string(); }
  /// Releases the reader, again and again, until its answer is there.
  class ReleasedUntil {
   public:
    ReleasedUntil(const SlowCt& slow, const std::future<LoadCt::Response>& answer) : slow_(slow), answer_(answer) {}
    ~ReleasedUntil() {
      while (answer_.valid() && answer_.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
        slow_.release();
      }
    }
    ReleasedUntil(const ReleasedUntil&) = delete;
    ReleasedUntil& operator=(const ReleasedUntil&) = delete;

   private:
    const SlowCt& slow_;
    const std::future<LoadCt::Response>& answer_;
  };

  /// Whether the reader waits at the pipe; once true it goes on, and finds that there are no voxels.
  bool release() const {
    const int pipe = open((folder_ / "voxels.raw").c_str(), O_WRONLY | O_NONBLOCK);
    if (pipe >= 0) close(pipe);
    return pipe >= 0;
  }

 private:
  std::filesystem::path folder_ = std::filesystem::temp_directory_path() /
                                  ("xray_registration_slow_" + std::to_string(ros::WallTime::now().toNSec()));
};

TEST_F(Node, AnswersWhileACtIsLoaded) {
  const SlowCt slow;
  ros::NodeHandle node;
  std::atomic<int> diagnostics{0};
  const ros::Subscriber subscriber = node.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const diagnostic_msgs::DiagnosticArrayConstPtr&) { ++diagnostics; });
  std::future<LoadCt::Response> first = std::async(std::launch::async, [&] { return probe_->loadCt(slow.path()); });
  // A future waits in its destructor: however this case ends, somebody has to let the reader go before.
  const SlowCt::ReleasedUntil released(slow, first);
  ASSERT_TRUE(waitFor([&] { return probe_->answer(publish(scene_->pose(0))).reason == "a CT is being loaded"; }));

  std::future<LoadCt::Response> second =
      std::async(std::launch::async, [&] { return probe_->loadCt(scene_->ctPath()); });
  std::future<bool> other = std::async(std::launch::async, [&] { return probe_->trigger("reset"); });
  const int diagnostics_before = diagnostics;
  const auto isReady = [](const auto& answer) {
    return answer.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  };
  EXPECT_TRUE(waitFor([&] { return isReady(second) && isReady(other) && diagnostics > diagnostics_before; }, 10.0));
  EXPECT_FALSE(isReady(first));

  ASSERT_TRUE(waitFor([&] {
    slow.release();
    return isReady(first);
  }));
  EXPECT_FALSE(first.get().success);
  const LoadCt::Response answer = second.get();
  EXPECT_FALSE(answer.success);
  EXPECT_NE(answer.message.find("being loaded"), std::string::npos) << answer.message;
  EXPECT_TRUE(other.get());
  ASSERT_NO_FATAL_FAILURE(track(0));  // The CT that was there is still there.
}

TEST_F(Node, TakesAnotherCtWhileTracking) {
  const std::string other =
      std::filesystem::temp_directory_path() / ("xray_registration_other_" + std::to_string(getpid()) + ".nii.gz");
  std::filesystem::copy_file(scene_->ctPath(), other, std::filesystem::copy_options::overwrite_existing);
  ASSERT_NO_FATAL_FAILURE(track(0));
  const LoadCt::Response loaded = probe_->loadCt(other);
  std::filesystem::remove(other);
  ASSERT_TRUE(loaded.success) << loaded.message;
  const ros::Time stamp = publish(scene_->pose(0));
  expectRefused(stamp, "pose");
  EXPECT_EQ(probe_->answer(stamp).state, RegistrationStatus::WAITING_FOR_POSE);
  EXPECT_NE(probe_->answer(stamp).ct.find("other"), std::string::npos);
  ASSERT_NO_FATAL_FAILURE(track(0));
}

TEST_F(Node, IsLostAndFindsBack) {
  ASSERT_NO_FATAL_FAILURE(track(0));
  const RigidTransform away = elsewhere();
  RegistrationStatus status;
  for (int i = 0; i < 5; ++i) {  // tracking/frames_until_lost
    EXPECT_NE(status.state, RegistrationStatus::LOST);
    const ros::Time stamp = publish(away);
    expectRefused(stamp, "");
    status = probe_->answer(stamp);
    EXPECT_TRUE(status.registered) << status.reason;
  }
  EXPECT_EQ(status.state, RegistrationStatus::LOST);
  const ros::Time stamp = publish(scene_->pose(1));
  expectAccepted(stamp, scene_->pose(1));
  EXPECT_EQ(probe_->answer(stamp).state, RegistrationStatus::TRACKING);
}

TEST_F(Node, CountsWhatReachedTheSolverAndWhatWasAccepted) {
  ASSERT_NO_FATAL_FAILURE(track(0));
  const RegistrationStatus accepted = probe_->answer(publish(scene_->pose(0)));
  EXPECT_TRUE(accepted.registered);

  sensor_msgs::Image coloured = scene_->image(scene_->pose(0), nextStamp(), kFrame);
  coloured.encoding = "bgr8";
  probe_->publish(coloured, scene_->info(coloured.header));
  const RegistrationStatus unusable = probe_->answer(coloured.header.stamp);
  EXPECT_FALSE(unusable.registered);
  EXPECT_EQ(unusable.frames_registered, accepted.frames_registered);
  EXPECT_EQ(unusable.frames_accepted, accepted.frames_accepted);

  const RegistrationStatus refused = probe_->answer(publish(elsewhere()));
  EXPECT_TRUE(refused.registered) << refused.reason;
  EXPECT_EQ(refused.frames_registered, accepted.frames_registered + 1);
  EXPECT_EQ(refused.frames_accepted, accepted.frames_accepted);
  EXPECT_EQ(refused.frames_refused, accepted.frames_refused + 2);
}

TEST_F(Node, WaitsForAPose) {
  const ros::Time stamp = publish(scene_->pose(0));
  expectRefused(stamp, "pose");
  EXPECT_EQ(probe_->answer(stamp).state, RegistrationStatus::WAITING_FOR_POSE);
}

TEST_F(Node, RefusesPosesThatAreNone) {
  expectRefused(publish(scene_->pose(0)), "pose");  // From here on the node knows the camera's frame.
  SetInitialPose call;
  call.request.pose.header.frame_id = kFrame;  // The quaternion of a default message is 0.
  ASSERT_TRUE(ros::service::call("registration/set_initial_pose", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_FALSE(probe_->setPose(scene_->pose(0), "").success);
  const SetInitialPose::Response unknown = probe_->setPose(scene_->pose(0), "no_such_frame");
  EXPECT_FALSE(unknown.success);
  EXPECT_NE(unknown.message.find("no_such_frame"), std::string::npos) << unknown.message;
}

TEST_F(Node, FollowsTheHead) {
  startAt(scene_->pose(0));
  for (int i = 0; i < 6; ++i) {
    const ros::Time stamp = publish(scene_->pose(i));
    expectAccepted(stamp, scene_->pose(i));
    EXPECT_EQ(probe_->answer(stamp).state, RegistrationStatus::TRACKING);
    ASSERT_TRUE(waitFor([&] { return !probe_->transforms(stamp).empty() && !probe_->poses(stamp).empty(); }));
    const geometry_msgs::TransformStamped transform = probe_->transforms(stamp)[0];
    EXPECT_EQ(transform.header.frame_id, kFrame);
    const PoseError error = scene_->error(fromTransform(transform.transform), scene_->pose(i));
    EXPECT_LT(error.inplane_mm, kInplaneTolerance);
    EXPECT_LT(error.mtre_mm, kMtreTolerance);
    const geometry_msgs::PoseWithCovarianceStamped pose = probe_->poses(stamp)[0];
    EXPECT_EQ(pose.header.frame_id, kFrame);
    for (int k = 0; k < 6; ++k) EXPECT_GT(pose.pose.covariance[k * 7], 0.0);
  }
}

TEST_F(Node, SendsTfOnceForAStamp) {
  ASSERT_NO_FATAL_FAILURE(startAt(scene_->pose(6)));
  const sensor_msgs::Image image = scene_->image(scene_->pose(6), nextStamp(), kFrame);
  probe_->publish(image, scene_->info(image.header));
  expectAccepted(image.header.stamp, scene_->pose(6));
  probe_->publish(image, scene_->info(image.header));
  const RegistrationStatus again = probe_->answer(image.header.stamp, 2);
  EXPECT_FALSE(again.accepted);
  EXPECT_NE(again.reason.find("stamp"), std::string::npos) << again.reason;
  EXPECT_EQ(probe_->transforms(image.header.stamp).size(), 1U);
}

TEST_F(Node, RefusesBadFramesAndGoesOn) {
  ASSERT_NO_FATAL_FAILURE(track(6));
  struct Case {
    std::string word;
    std::function<void(sensor_msgs::Image*, sensor_msgs::CameraInfo*)> spoil;
  };
  const std::vector<Case> cases = {
      {"encoding", [](auto* image, auto*) { image->encoding = "bgr8"; }},
      {"bytes", [](auto* image, auto*) { image->data.resize(100); }},
      {"step", [](auto* image, auto*) { image->step = 7; }},
      {"", [](auto*, auto* info) { info->K[0] = 0.0; }},
      {"", [](auto*, auto* info) { info->width = 0; }},
      {"", [](auto*, auto* info) { info->height = 64; }},
      {"frame_id", [](auto* image, auto*) { image->header.frame_id = "ct"; }},
      {"camera_info", [](auto*, auto* info) { info->header.stamp += ros::Duration(0.001); }},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    sensor_msgs::Image image = scene_->image(scene_->pose(6), nextStamp(), kFrame);
    sensor_msgs::CameraInfo info = scene_->info(image.header);
    cases[i].spoil(&image, &info);
    probe_->publish(image, info);
    SCOPED_TRACE("case " + std::to_string(i));
    expectRefused(image.header.stamp, cases[i].word);
  }
  sensor_msgs::Image unstamped = scene_->image(scene_->pose(6), ros::Time(), kFrame);
  probe_->publish(unstamped, scene_->info(unstamped.header));
  expectRefused(ros::Time(), "stamp");

  expectAccepted(publish(scene_->pose(6)), scene_->pose(6));
}

TEST_F(Node, TakesBigEndianAndPaddedRowsAndFloats) {
  ASSERT_NO_FATAL_FAILURE(track(6));
  sensor_msgs::Image swapped = scene_->image(scene_->pose(6), nextStamp(), kFrame);
  sensor_msgs::Image padded = swapped;
  padded.is_bigendian = 1;
  padded.step = swapped.step + 6;
  padded.data.assign(padded.step * padded.height, 0xAB);
  for (std::uint32_t v = 0; v < swapped.height; ++v) {
    for (std::uint32_t b = 0; b < swapped.step; ++b)
      padded.data[v * padded.step + (b ^ 1U)] = swapped.data[v * swapped.step + b];
  }
  probe_->publish(padded, scene_->info(padded.header));
  expectAccepted(padded.header.stamp, scene_->pose(6));

  sensor_msgs::Image floats = toFloatMessage(floatsOf(rawImage(swapped).pixels));
  floats.header = swapped.header;
  floats.header.stamp = nextStamp();
  probe_->publish(floats, scene_->info(floats.header));
  expectAccepted(floats.header.stamp, scene_->pose(6));
}

TEST_F(Node, ShowsPicturesToWhoLooks) {
  ASSERT_NO_FATAL_FAILURE(track(6));
  ros::NodeHandle node;
  std::mutex mutex;
  sensor_msgs::ImageConstPtr drr;
  sensor_msgs::ImageConstPtr overlay;
  visualization_msgs::MarkerConstPtr surface;
  const auto keep = [&mutex](auto* slot) {
    return [&mutex, slot](const auto& message) {
      const std::lock_guard<std::mutex> lock(mutex);
      *slot = message;
    };
  };
  const ros::Subscriber drr_subscriber = node.subscribe<sensor_msgs::Image>("registration/drr", 1, keep(&drr));
  const ros::Subscriber overlay_subscriber =
      node.subscribe<sensor_msgs::Image>("registration/overlay", 1, keep(&overlay));
  const ros::Subscriber surface_subscriber =
      node.subscribe<visualization_msgs::Marker>("registration/ct_surface", 1, keep(&surface));
  ASSERT_TRUE(
      waitFor([&] { return drr_subscriber.getNumPublishers() > 0 && overlay_subscriber.getNumPublishers() > 0; }));
  ASSERT_TRUE(waitFor([&] {
    publish(scene_->pose(6));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const std::lock_guard<std::mutex> lock(mutex);
    return drr && overlay && surface;
  }));
  const std::lock_guard<std::mutex> lock(mutex);
  EXPECT_EQ(drr->encoding, "mono8");
  EXPECT_EQ(drr->width, 128U);
  EXPECT_EQ(drr->header.frame_id, kFrame);
  EXPECT_EQ(overlay->encoding, "rgb8");
  EXPECT_EQ(overlay->width, 128U);
  EXPECT_EQ(surface->header.frame_id, "ct");
  EXPECT_GT(surface->points.size(), 300U);
}

TEST_F(Node, IsSwitchedOffAndOn) {
  ASSERT_NO_FATAL_FAILURE(track(6));
  std_srvs::SetBool call;
  call.request.data = 0;
  ASSERT_TRUE(ros::service::call("registration/set_enabled", call));
  expectRefused(publish(scene_->pose(6)), "switched off");
  call.request.data = 1;
  ASSERT_TRUE(ros::service::call("registration/set_enabled", call));
  expectAccepted(publish(scene_->pose(6)), scene_->pose(6));
}

TEST_F(Node, TakesThePoseInAnyConnectedFrame) {
  tf2_ros::StaticTransformBroadcaster broadcaster;
  RigidTransform T_camera_table = RigidTransform::Identity();
  T_camera_table.linear() = rotationFromVector(Eigen::Vector3d(0.2, 1.1, -0.4));
  T_camera_table.translation() = Eigen::Vector3d(100.0, 50.0, 900.0);
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = kFrame;
  transform.child_frame_id = "table";
  transform.transform = toTransform(T_camera_table);
  broadcaster.sendTransform(transform);
  expectRefused(publish(scene_->pose(3)), "pose");  // From here on the node knows the camera's frame.
  const RigidTransform start = T_camera_table.inverse() * scene_->disturbed(scene_->pose(3));
  ASSERT_TRUE(waitFor([&] { return probe_->setPose(start, "table").success != 0; }, 10.0));
  expectAccepted(publish(scene_->pose(3)), scene_->pose(3));
}

TEST_F(Node, TakesInitialposeFromItsTopic) {
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 1);
  ASSERT_TRUE(waitFor([&] { return publisher.getNumSubscribers() > 0; }));
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.frame_id = kFrame;
  message.pose.pose = toPose(scene_->disturbed(scene_->pose(1)));
  publisher.publish(message);
  ASSERT_TRUE(waitFor([&] { return probe_->answer(publish(scene_->pose(1))).accepted != 0; }, 10.0));
}

TEST_F(Node, TuningChangesLive) {
  ASSERT_NO_FATAL_FAILURE(track(1));
  dynamic_reconfigure::Reconfigure call;
  call.request.config.doubles.resize(1);
  call.request.config.doubles[0].name = "min_similarity";
  call.request.config.doubles[0].value = 1.0;  // No noisy image reaches it.
  ASSERT_TRUE(ros::service::call("registration/accept/set_parameters", call));
  expectRefused(publish(scene_->pose(1)), "similar");
  call.request.config.doubles[0].value = 0.54;  // As config/default.yaml has it.
  ASSERT_TRUE(ros::service::call("registration/accept/set_parameters", call));
  startAt(scene_->pose(1));
  expectAccepted(publish(scene_->pose(1)), scene_->pose(1));
}

TEST_F(Node, TuningThatIsNoneIsRefused) {
  ASSERT_NO_FATAL_FAILURE(track(1));
  dynamic_reconfigure::Reconfigure call;
  call.request.config.doubles.resize(2);
  call.request.config.doubles[0].name = "max_jump_mm";
  call.request.config.doubles[0].value = 17.0;
  call.request.config.doubles[1].name = "min_similarity";
  call.request.config.doubles[1].value = std::nan("");
  ASSERT_TRUE(ros::service::call("registration/accept/set_parameters", call));
  for (const auto& stays : call.response.config.doubles) {  // All of it or nothing.
    if (stays.name == "max_jump_mm") {
      EXPECT_EQ(stays.value, 30.0);
    }
    EXPECT_FALSE(std::isnan(stays.value)) << stays.name;
  }
  dynamic_reconfigure::Reconfigure words;
  words.request.config.strs.resize(1);
  words.request.config.strs[0].name = "similarity";
  words.request.config.strs[0].value = "nonsense";
  ASSERT_TRUE(ros::service::call("registration/solver/set_parameters", words));
  ASSERT_EQ(words.response.config.strs.size(), 1U);
  EXPECT_EQ(words.response.config.strs[0].value, "local_normalised");
  expectAccepted(publish(scene_->pose(1)), scene_->pose(1));
}

TEST_F(Node, TuningOfWhatIsNotThereIsRefusedAndSaid) {
  std::mutex mutex;
  std::string said;
  ros::NodeHandle node;
  const ros::Subscriber log =
      node.subscribe<rosgraph_msgs::Log>("/rosout", 100, [&](const rosgraph_msgs::LogConstPtr& line) {
        const std::lock_guard<std::mutex> lock(mutex);
        said += line->msg + "\n";
      });
  ASSERT_TRUE(waitFor([&] { return log.getNumPublishers() > 0; }));
  dynamic_reconfigure::Reconfigure call;
  call.request.config.ints.resize(2);
  call.request.config.ints[0].name = "search_poses";
  call.request.config.ints[0].value = 7;
  call.request.config.ints[1].name = "serch_poses";
  call.request.config.ints[1].value = 8;
  // Until the log is connected, what is said is lost.
  ASSERT_TRUE(waitFor([&] {
    EXPECT_TRUE(ros::service::call("registration/solver/set_parameters", call));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const std::lock_guard<std::mutex> lock(mutex);
    return said.find("solver/set_parameters: there is no parameter 'serch_poses'; allowed: ") != std::string::npos;
  })) << said;
  for (const auto& stays : call.response.config.ints) {  // All of it or nothing.
    if (stays.name == "search_poses") {
      EXPECT_EQ(stays.value, 96);
    }
  }
  call.request.config.ints.resize(1);
  ASSERT_TRUE(ros::service::call("registration/solver/set_parameters", call));
  for (const auto& taken : call.response.config.ints) {
    if (taken.name == "search_poses") {
      EXPECT_EQ(taken.value, 7);
    }
  }
  call.request.config.ints[0].value = 96;
  ASSERT_TRUE(ros::service::call("registration/solver/set_parameters", call));
}

TEST_F(Node, CountsWhatItCannotHold) {
  ASSERT_NO_FATAL_FAILURE(track(1));
  // Faster than any device: the messages are made beforehand and sent without a pause.
  constexpr int kFrames = 150;
  const sensor_msgs::Image image = scene_->image(scene_->pose(1), ros::Time(1.0), kFrame);
  std::vector<sensor_msgs::Image> frames(kFrames, image);
  for (int i = 0; i < kFrames; ++i) frames[i].data[0] = static_cast<std::uint8_t>(i);  // None is held.
  const RegistrationStatus before = probe_->answer(publish(scene_->pose(1)));
  const std::size_t statuses_before = probe_->statusCount();
  RegistrationStatus after = before;
  // On a machine that is busy with other things the sender may be the slower one: then a burst was none.
  for (int burst = 0; burst < 20 && after.frames_dropped == before.frames_dropped; ++burst) {
    for (sensor_msgs::Image& frame : frames) {
      frame.header.stamp = nextStamp();
      probe_->publish(frame, scene_->info(frame.header));
    }
    // The newest is never the one that is dropped.
    const RegistrationStatus last = probe_->answer(frames.back().header.stamp);
    EXPECT_TRUE(last.accepted) << last.reason;
    // The last dropped frame may be told of after the newest frame's answer; one frame later all is counted.
    after = probe_->answer(publish(scene_->pose(1)));
  }
  const std::uint64_t received = after.frames_received - before.frames_received;
  EXPECT_GT(after.frames_dropped, before.frames_dropped);
  waitFor([&] { return probe_->statusCount() - statuses_before >= received; }, 10.0);
  EXPECT_EQ(probe_->statusCount() - statuses_before, received);
  EXPECT_EQ(received, (after.frames_accepted - before.frames_accepted) +
                          (after.frames_dropped - before.frames_dropped) +
                          (after.frames_refused - before.frames_refused));
}

TEST_F(Node, ForgetsThePoseOnResetAndKeepsTheCt) {
  ASSERT_NO_FATAL_FAILURE(track(1));
  ASSERT_TRUE(probe_->trigger("reset"));
  const ros::Time stamp = publish(scene_->pose(1));
  expectRefused(stamp, "pose");
  EXPECT_EQ(probe_->answer(stamp).state, RegistrationStatus::WAITING_FOR_POSE);
  EXPECT_FALSE(probe_->answer(stamp).ct.empty());
}

TEST_F(Node, TellsDiagnostics) {
  ros::NodeHandle node;
  std::mutex mutex;
  diagnostic_msgs::DiagnosticStatus found;
  const ros::Subscriber subscriber = node.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const diagnostic_msgs::DiagnosticArrayConstPtr& message) {
        const std::lock_guard<std::mutex> lock(mutex);
        for (const auto& status : message->status) {
          if (status.name.find("registration") != std::string::npos) found = status;
        }
      });
  ASSERT_TRUE(waitFor([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return !found.values.empty();
  }));
  const std::lock_guard<std::mutex> lock(mutex);
  std::string keys;
  for (const auto& value : found.values) keys += value.key + ";";
  for (const char* key : {"state", "device", "device bytes", "rate", "latency", "frames registered", "frames accepted",
                          "dropped", "last error"}) {
    EXPECT_NE(keys.find(key), std::string::npos) << keys;
  }
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "node_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}

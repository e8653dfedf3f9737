// A node whose device fails: at the start, while a CT is loaded, in the middle of a solve, while a picture is drawn. It
// says so, gives no pose that is wrong, opens the device anew once, and recovers when the device does.
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <memory>

#include "node_probe.h"
#include "test/drr/opencl/failing_opencl.h"

namespace xray_registration {
namespace {

namespace fo = failing_opencl;

const char* const kFrame = "xray_optical";
const char* const kFailure = "code -5";

/// The node with the layer that fails calls, as a process of its own.
class FailingNode {
 public:
  FailingNode() {
    std::string path = XRAY_FAILING_NODE;
    std::string name = "__name:=failing";
    char* const arguments[] = {path.data(), name.data(), nullptr};
    if (posix_spawn(&process_, path.c_str(), nullptr, nullptr, arguments, environ) != 0) process_ = -1;
  }
  ~FailingNode() {
    if (process_ > 0) kill(process_, SIGKILL), waitpid(process_, nullptr, 0);
  }
  FailingNode(const FailingNode&) = delete;
  FailingNode& operator=(const FailingNode&) = delete;

  bool isAlive() const { return process_ > 0 && waitpid(process_, nullptr, WNOHANG) == 0; }

  /// Asks it to end, and says what it exits with.
  int end() {
    int status = -1;
    kill(process_, SIGINT);
    waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t process_ = -1;
};

class FailingDevice : public testing::Test {
 protected:
  void SetUp() override { fo::heal(); }

  void start() {
    node_ = std::make_unique<FailingNode>();
    probe_ = std::make_unique<NodeProbe>("failing", std::vector<std::string>{""});
    ASSERT_TRUE(probe_->connected());
  }
  void load() {
    const LoadCt::Response loaded = probe_->loadCt(scene_.ctPath());
    ASSERT_TRUE(loaded.success) << loaded.message;
  }
  void TearDown() override {
    fo::heal();
    ASSERT_TRUE(node_->isAlive());
    EXPECT_EQ(node_->end(), 0);
  }

  /// The answer to the head at the pose of that number; whatever it is, no pose is wrong.
  RegistrationStatus frame(int number) {
    const sensor_msgs::Image image = scene_.image(scene_.pose(number), ros::Time::now(), kFrame);
    probe_->publish(image, scene_.info(image.header));
    const RegistrationStatus status = probe_->answer(image.header.stamp);
    EXPECT_NE(status.reason, "no status came");
    if (status.accepted) {
      EXPECT_LT(scene_.error(fromPose(status.pose), scene_.pose(number)).inplane_mm, kInplaneTolerance);
    } else {
      EXPECT_FALSE(status.reason.empty());
      EXPECT_TRUE(probe_->transforms(image.header.stamp).empty());
      EXPECT_TRUE(probe_->poses(image.header.stamp).empty());
    }
    return status;
  }

  void track() {
    ASSERT_TRUE(probe_->trigger("reset"));
    const SetInitialPose::Response set = probe_->setPose(scene_.disturbed(scene_.pose(0)), kFrame);
    ASSERT_TRUE(set.success) << set.message;
    RegistrationStatus status = frame(0);
    ASSERT_TRUE(status.accepted) << status.reason;
    status = frame(1);
    ASSERT_TRUE(status.accepted) << status.reason;
  }

  void expectFault() {
    const RegistrationStatus status = frame(1);
    EXPECT_EQ(status.state, RegistrationStatus::FAULT);
    EXPECT_NE(status.reason.find(kFailure), std::string::npos) << status.reason;
  }

  /// How many calls of OpenCL come while `work` is done.
  template <typename Work>
  long callsOf(const Work& work) {
    fo::heal();
    work();
    return fo::calls();
  }

  Scene scene_{"failing_device"};
  std::unique_ptr<FailingNode> node_;
  std::unique_ptr<NodeProbe> probe_;
};

TEST_F(FailingDevice, AtTheStart) {
  fo::failFrom(0, fo::kForGood);
  start();
  ASSERT_TRUE(waitFor([] { return fo::failures() > 0; }));
  const LoadCt::Response refused = probe_->loadCt(scene_.ctPath());
  EXPECT_FALSE(refused.success);
  EXPECT_NE(refused.message.find(kFailure), std::string::npos) << refused.message;
  expectFault();
  fo::heal();
  load();
  track();
}

TEST_F(FailingDevice, WhileACtIsLoaded) {
  start();
  load();
  const long calls = callsOf([this] { load(); });
  for (const double share : {0.0, 0.3, 0.7, 0.97}) {
    const long call = static_cast<long>(share * static_cast<double>(calls));
    SCOPED_TRACE("call " + std::to_string(call) + " of " + std::to_string(calls));
    fo::failFrom(call);
    const LoadCt::Response once = probe_->loadCt(scene_.ctPath());
    EXPECT_TRUE(once.success) << "it is tried once more: " << once.message;
    EXPECT_EQ(fo::failures(), 1);
    fo::failFrom(call, fo::kForGood);
    const LoadCt::Response never = probe_->loadCt(scene_.ctPath());
    EXPECT_FALSE(never.success);
    EXPECT_NE(never.message.find(kFailure), std::string::npos) << never.message;
    expectFault();
    fo::heal();
    expectFault();  // Until somebody says that it may be tried again.
    track();
  }
}

TEST_F(FailingDevice, InTheMiddleOfASolve) {
  start();
  load();
  ASSERT_NO_FATAL_FAILURE(track());
  const long calls = callsOf([this] { frame(2); });
  for (const double share : {0.0, 0.2, 0.5, 0.8}) {
    const long call = static_cast<long>(share * static_cast<double>(calls));
    SCOPED_TRACE("call " + std::to_string(call) + " of " + std::to_string(calls));
    ASSERT_NO_FATAL_FAILURE(track());
    fo::failFrom(call);
    RegistrationStatus once = frame(2);
    // Pictures are made when there is time: this frame may have had fewer calls than the one that was counted.
    for (int more = 0; more < 5 && fo::failures() == 0; ++more) once = frame(2);
    EXPECT_EQ(fo::failures(), 1);
    EXPECT_TRUE(once.accepted || once.reason.find("it was opened anew") != std::string::npos) << once.reason;
    const RegistrationStatus after = frame(2);
    EXPECT_TRUE(after.accepted) << after.reason;
    fo::failFrom(call, fo::kForGood);
    for (int more = 0; more < 5 && fo::failures() == 0; ++more) frame(2);
    expectFault();
    fo::heal();
  }
  track();
}

TEST_F(FailingDevice, WhileAPictureIsDrawn) {
  start();
  load();
  ASSERT_NO_FATAL_FAILURE(track());
  long without = 0;  // Some frames are also looked at for what was told wrongly.
  for (int i = 0; i < 3; ++i) without = std::max(without, callsOf([this] { frame(2); }));
  Messages<sensor_msgs::Image> overlays("failing/overlay");
  ASSERT_TRUE(waitFor([&] {
    frame(2);
    return !overlays.take().empty();
  }));
  fo::failFrom(without + 3, fo::kForGood);
  ASSERT_TRUE(waitFor([&] {
    frame(2);
    return fo::failures() > 0;
  }));
  expectFault();
  fo::heal();
  track();
  EXPECT_TRUE(waitFor([&] { return !overlays.take().empty(); }));
}

/// The file by which this process tells the node's what is to fail.
std::string makeControlFile() {
  std::string path = (std::filesystem::temp_directory_path() / "xray_failing_opencl_XXXXXX").string();
  const int file = mkstemp(path.data());
  if (file >= 0) close(file);
  std::filesystem::resize_file(path, sizeof(fo::Control));
  return path;
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const std::string control = xray_registration::makeControlFile();
  setenv("XRAY_FAILING_OPENCL", control.c_str(), 1);
  ros::init(argc, argv, "failing_device_rostest");
  const ros::NodeHandle node;
  ros::AsyncSpinner spinner(2);
  spinner.start();
  const int result = RUN_ALL_TESTS();
  std::filesystem::remove(control);
  return result;
}

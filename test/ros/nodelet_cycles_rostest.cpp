// A nodelet that is loaded and unloaded again and again leaves nothing behind.
#include <gtest/gtest.h>
#include <nodelet/loader.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define XRAY_HAS_SANITIZER
// Of sanitizer/allocator_interface.h, which clang has; GCC has the function alone.
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();
#endif

namespace xray_registration {
namespace {

struct Use {
  long descriptors = 0;
  long threads = 0;
  double memory_mb = 0.0;
};

long entriesOf(const std::string& folder) {
  return std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator());
}

/// Resident; a sanitizer keeps what is freed for a while, so there what is allocated.
double memoryMb() {
  constexpr double kMb = 1024.0 * 1024.0;
#ifdef XRAY_HAS_SANITIZER
  return static_cast<double>(__sanitizer_get_current_allocated_bytes()) / kMb;
#else
  std::ifstream file("/proc/self/statm");
  long size = 0;
  long resident = 0;
  file >> size >> resident;
  return static_cast<double>(resident * sysconf(_SC_PAGESIZE)) / kMb;
#endif
}

Use used() { return {entriesOf("/proc/self/fd"), entriesOf("/proc/self/task"), memoryMb()}; }

TEST(NodeletCycles, LeaveNothingBehind) {
  constexpr int kCycles = 160;
  // Kernels, plugins and pools are loaded once, and only every fifth cycle opens the device: 190 MiB are reached after
  // some hundred cycles, and are the same after 220.
  constexpr int kWarmUp = 100;
  nodelet::Loader loader(false);
  Use before;
  for (int i = 0; i < kCycles; ++i) {
    if (i == kWarmUp) before = used();
    // Every fifth time it opens its device, which is most of a cycle's work; the other times it finds none.
    const bool opens_device = i % 5 == 0;
    ros::param::set("/cycle/device", opens_device ? "auto" : "no such device");
    ASSERT_TRUE(loader.load("/cycle", "xray_registration/RegistrationNodelet", {}, {})) << "cycle " << i;
    // Its threads serve, after the device was opened.
    std_srvs::Trigger call;
    ASSERT_TRUE(ros::service::call("/cycle/reset", call)) << "cycle " << i;
    if (opens_device) ros::WallDuration(0.1).sleep();
    ASSERT_TRUE(loader.unload("/cycle")) << "cycle " << i;
  }
  const Use after = used();
  std::printf("from cycle %d to %d: %ld to %ld descriptors, %ld to %ld threads, %.1f to %.1f MiB\n", kWarmUp, kCycles,
              before.descriptors, after.descriptors, before.threads, after.threads, before.memory_mb, after.memory_mb);
  // A connection to another node, or a thread that is just ending, may come and go.
  EXPECT_LE(after.descriptors, before.descriptors + 4);
  EXPECT_LE(after.threads, before.threads + 2);
  // Less than the smallest thing that a node owns: a program of the device, which every fifth cycle makes, has several
  // MiB. Pools go up and down by 7 MiB.
  EXPECT_LT(after.memory_mb, before.memory_mb + 0.15 * (kCycles - kWarmUp));
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "nodelet_cycles_rostest");
  const ros::NodeHandle node;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}

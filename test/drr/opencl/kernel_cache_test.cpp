#include "drr/opencl/kernel_cache.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

class KernelCacheTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "kernel_cache_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    std::ofstream(folder_ / "file") << "no folder can be made in here";
    nowhere_ = (folder_ / "file" / "below").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string in(const char* name) const { return (folder_ / name).string(); }

  fs::path folder_;
  std::string nowhere_;
};

TEST_F(KernelCacheTest, ThatOfPoclIsTakenWhereItCanBeWritten) {
  const KernelCache by_home = chooseKernelCache({"", "", in("home"), "", in("tmp")});
  EXPECT_TRUE(by_home.is_drivers);
  EXPECT_EQ(by_home.folder, in("home/.cache/pocl/kcache"));
  EXPECT_TRUE(fs::is_directory(by_home.folder));
  EXPECT_EQ(chooseKernelCache({"", in("xdg"), in("home"), "", in("tmp")}).folder, in("xdg/pocl/kcache"));
  EXPECT_EQ(chooseKernelCache({in("named"), in("xdg"), in("home"), "", in("tmp")}).folder, in("named"));
}

TEST_F(KernelCacheTest, WithoutAHomeAFolderOfRosOrTheTemporaryOneIsMade) {
  const KernelCache by_ros = chooseKernelCache({"", "", nowhere_, in("ros"), in("tmp")});
  EXPECT_FALSE(by_ros.is_drivers);
  EXPECT_EQ(by_ros.folder, in("ros/xray_registration_kernels"));
  EXPECT_TRUE(fs::is_directory(by_ros.folder));
  const KernelCache temporary = chooseKernelCache({"", "", "", "", in("tmp")});
  EXPECT_EQ(temporary.folder, in("tmp/xray_registration_kernels_") + std::to_string(geteuid()));
  EXPECT_EQ(fs::status(temporary.folder).permissions() & fs::perms::mask, fs::perms::owner_all);
  EXPECT_EQ(chooseKernelCache({"", "", nowhere_, nowhere_, nowhere_}).folder, "");
}

TEST_F(KernelCacheTest, WhatOthersCanWriteIsNotTaken) {
  const KernelCache first = chooseKernelCache({"", "", "", in("ros"), nowhere_});
  ASSERT_NE(first.folder, "");
  ASSERT_EQ(chmod(first.folder.c_str(), 0777), 0);
  EXPECT_EQ(chooseKernelCache({"", "", "", in("ros"), nowhere_}).folder, "");
  // Nor a link to somewhere else.
  fs::remove_all(first.folder);
  fs::create_directory_symlink(folder_, first.folder);
  EXPECT_EQ(chooseKernelCache({"", "", "", in("ros"), nowhere_}).folder, "");
}

TEST_F(KernelCacheTest, TheProcessIsToldOnce) {
  setenv("POCL_CACHE_DIR", nowhere_.c_str(), 1);
  setenv("ROS_HOME", in("ros").c_str(), 1);
  EXPECT_NE(useKernelCache().find(in("ros/xray_registration_kernels")), std::string::npos);
  EXPECT_EQ(std::getenv("POCL_CACHE_DIR"), in("ros/xray_registration_kernels"));
  EXPECT_EQ(useKernelCache(), "");
  unsetenv("POCL_CACHE_DIR");
  unsetenv("ROS_HOME");
}

}  // namespace
}  // namespace xray_registration

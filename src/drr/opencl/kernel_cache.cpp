#include "drr/opencl/kernel_cache.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <vector>

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

/// Whether the folder is there, or can be made, and can be written.
bool canBeWritten(const std::string& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  return fs::is_directory(folder, failed) && access(folder.c_str(), R_OK | W_OK | X_OK) == 0;
}

/// The same of a folder where others might have been first: nobody else can put files into it.
bool isOwnFolder(const std::string& folder) {
  std::error_code failed;
  if (!fs::exists(folder, failed)) {
    fs::create_directories(fs::path(folder).parent_path(), failed);
    if (mkdir(folder.c_str(), S_IRWXU) != 0) return false;
  }
  struct stat seen {};
  if (lstat(folder.c_str(), &seen) != 0 || !S_ISDIR(seen.st_mode)) return false;
  const bool others_write = (seen.st_mode & (S_IWGRP | S_IWOTH)) != 0;
  return seen.st_uid == geteuid() && !others_write && canBeWritten(folder);
}

std::string below(const std::string& folder, const char* rest) { return folder.empty() ? "" : folder + rest; }

}  // namespace

CacheEnvironment cacheEnvironment() {
  CacheEnvironment environment{variable("POCL_CACHE_DIR"), variable("XDG_CACHE_HOME"), variable("HOME"),
                               variable("ROS_HOME"), variable("TMPDIR")};
  if (environment.temporary.empty()) environment.temporary = "/tmp";
  return environment;
}

KernelCache chooseKernelCache(const CacheEnvironment& e) {
  std::string drivers = e.pocl_cache_dir;
  if (drivers.empty()) drivers = below(e.xdg_cache_home, "/pocl/kcache");
  if (drivers.empty()) drivers = below(e.home, "/.cache/pocl/kcache");
  if (!drivers.empty() && canBeWritten(drivers)) return {drivers, true};
  for (const std::string& folder :
       {below(e.ros_home, "/xray_registration_kernels"), below(e.home, "/.ros/xray_registration_kernels"),
        e.temporary + "/xray_registration_kernels_" + std::to_string(geteuid())}) {
    if (!folder.empty() && isOwnFolder(folder)) return {folder, false};
  }
  return {};
}

std::string useKernelCache() {
  const KernelCache cache = chooseKernelCache(cacheEnvironment());
  if (cache.is_drivers) return "";
  if (cache.folder.empty())
    return "compiled kernels cannot be kept: no folder for them can be written (POCL_CACHE_DIR)";
  setenv("POCL_CACHE_DIR", cache.folder.c_str(), 1);
  return "compiled kernels are kept in " + cache.folder + ", since PoCL's own folder cannot be written";
}

}  // namespace xray_registration

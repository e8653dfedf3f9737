#pragma once

#include <string>

namespace xray_registration {

/// Where compiled kernels may be kept, as the environment says; empty where it does not.
struct CacheEnvironment {
  std::string pocl_cache_dir;  ///< POCL_CACHE_DIR
  std::string xdg_cache_home;  ///< XDG_CACHE_HOME
  std::string home;            ///< HOME
  std::string ros_home;        ///< ROS_HOME
  std::string temporary;       ///< TMPDIR, or /tmp
};

CacheEnvironment cacheEnvironment();

struct KernelCache {
  std::string folder;       ///< Exists and can be written; empty when there is none.
  bool is_drivers = false;  ///< It is the one that PoCL would take by itself.
};

/// PoCL keeps compiled kernels in files, without which every start compiles for seconds. It looks at POCL_CACHE_DIR,
/// else below XDG_CACHE_HOME or HOME/.cache. Where that cannot be written (a service without a home, a read-only one) a
/// folder below ROS_HOME, HOME/.ros, or the temporary one is made, and taken only if nobody else can write it: PoCL
/// runs what it finds there.
KernelCache chooseKernelCache(const CacheEnvironment& environment);

/// Names the chosen folder to PoCL (POCL_CACHE_DIR of this process) where it would take another one. Before the first
/// call of OpenCL; again, it changes nothing. Drivers with caches of their own do not care.
/// @returns what to tell the user; empty when PoCL's own folder does.
std::string useKernelCache();

}  // namespace xray_registration

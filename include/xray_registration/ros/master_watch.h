#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "xray_registration/common/log.h"

namespace xray_registration {

/// Notices that the ROS master is gone and is back, or that there is another one, which knows nobody; says so, and
/// registers again what this process publishes, subscribes to and serves, which roscpp does not. Connections that exist
/// stay. On a thread of its own, since a master that is out of reach lets one wait; the destructor ends it.
class MasterWatch {
 public:
  explicit MasterWatch(Logger logger);
  ~MasterWatch();
  MasterWatch(const MasterWatch&) = delete;
  MasterWatch& operator=(const MasterWatch&) = delete;

 private:
  void run();
  void look();

  Logger logger_;
  std::optional<int> pid_;             ///< Of the master that knows this process.
  bool gone_ = false;                  ///< And this was said.
  std::vector<std::string> services_;  ///< Of this process, as the master knew them.
  int looks_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace xray_registration

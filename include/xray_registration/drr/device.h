#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "xray_registration/common/log.h"

namespace xray_registration {

/// The device failed, refused or disappeared; the message says which call, which device, and what to do.
class DeviceError : public std::runtime_error {
 public:
  DeviceError(const std::string& what, int code) : std::runtime_error(what), code_(code) {}
  int code() const { return code_; }  ///< The driver's error code, 0 when there is none.

 private:
  int code_;
};

struct OpenClDevice;

/// One OpenCL device, its context and its queues. No global state: destroy the object and everything of it is released.
/// Not thread-safe; one thread uses a Device at a time, but a second one may use the queue for uploads.
class Device {
 public:
  /// `choice`: "auto" (a GPU when there is one, else a CPU), "gpu", "cpu", or a part of the device's name.
  /// @throws DeviceError when nothing fits; the message lists the devices that are there.
  explicit Device(const std::string& choice = "auto", const Logger& logger = {});
  ~Device();

  const std::string& name() const { return name_; }
  bool isGpu() const { return is_gpu_; }
  std::size_t maxAllocationBytes() const { return max_allocation_bytes_; }
  std::size_t globalMemoryBytes() const { return global_memory_bytes_; }
  int computeUnits() const { return compute_units_; }

  /// Waits until nothing is queued. @throws DeviceError.
  void finish() const;

  /// What room drr works with (drr/opencl/opencl_device.h); nobody else needs it.
  const OpenClDevice& openCl() const { return *opencl_; }

 private:
  std::unique_ptr<OpenClDevice> opencl_;
  std::string name_;
  bool is_gpu_ = false;
  std::size_t max_allocation_bytes_ = 0;
  std::size_t global_memory_bytes_ = 0;
  int compute_units_ = 1;
};

/// Names of all OpenCL devices, for messages and --help.
std::vector<std::string> listDevices();

}  // namespace xray_registration

#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/drr/opencl.h"

namespace xray_registration {

/// The device failed, refused or disappeared; the message says which call, which device, and what to do.
class DeviceError : public std::runtime_error {
 public:
  DeviceError(const std::string& what, int code) : std::runtime_error(what), code_(code) {}
  int code() const { return code_; }  ///< OpenCL error code, 0 when there is none.

 private:
  int code_;
};

/// One OpenCL device with its context and two in-order queues: one for the solve, one for uploads. No global state:
/// destroy the object and everything of it is released. Not thread-safe; one thread uses a Device at a time, but a
/// second one may use the queue for uploads.
class Device {
 public:
  /// `choice`: "auto" (a GPU when there is one, else a CPU), "gpu", "cpu", or a part of the device's name.
  /// @throws DeviceError when nothing fits; the message lists the devices that are there.
  explicit Device(const std::string& choice = "auto", const Logger& logger = {});

  const cl::Context& context() const { return context_; }
  const cl::Device& device() const { return device_; }
  cl::CommandQueue& solveQueue() { return solve_queue_; }
  cl::CommandQueue& uploadQueue() { return upload_queue_; }

  const std::string& name() const { return name_; }
  bool isGpu() const { return is_gpu_; }
  std::size_t maxAllocationBytes() const { return max_allocation_bytes_; }
  std::size_t globalMemoryBytes() const { return global_memory_bytes_; }
  int computeUnits() const { return compute_units_; }

  /// Compiles OpenCL C 1.2. @throws DeviceError with the build log.
  cl::Program build(const std::string& source, const std::string& options) const;

 private:
  cl::Context context_;
  cl::Device device_;
  cl::CommandQueue solve_queue_;
  cl::CommandQueue upload_queue_;
  std::string name_;
  bool is_gpu_ = false;
  std::size_t max_allocation_bytes_ = 0;
  std::size_t global_memory_bytes_ = 0;
  int compute_units_ = 1;
};

/// Names of all OpenCL devices, for messages and --help.
std::vector<std::string> listDevices();

}  // namespace xray_registration

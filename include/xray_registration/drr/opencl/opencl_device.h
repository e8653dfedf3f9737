#pragma once

#include <string>

#include "xray_registration/drr/device.h"
#include "xray_registration/drr/opencl/opencl.h"

namespace xray_registration {

/// The OpenCL side of a Device: its context and two in-order queues, one for the solve, one for uploads.
struct OpenClDevice {
  cl::Context context;
  cl::Device device;
  cl::CommandQueue solve_queue;  ///< With profiling: events know their times.
  cl::CommandQueue upload_queue;
  std::string name;

  /// Compiles OpenCL C 1.2. @throws DeviceError with the build log.
  cl::Program build(const std::string& source, const std::string& options) const;
};

}  // namespace xray_registration

#pragma once

#include <string>

#include "xray_registration/drr/opencl/opencl_device.h"

namespace xray_registration {

/// What to do about an error code, in brackets; empty when it does not say.
inline const char* remedyFor(cl_int code) {
  switch (code) {
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
    case CL_OUT_OF_HOST_MEMORY:
    case CL_INVALID_BUFFER_SIZE:
      return " (no room on the device: use a smaller CT or another device)";
    case CL_OUT_OF_RESOURCES:  // Drivers say so of both.
      return " (no room on the device, or it is lost: use a smaller CT or another device, look at the driver's log)";
    case CL_DEVICE_NOT_AVAILABLE:
      return " (the device is lost or taken: look at the driver's log, or use another device)";
    default:
      return "";
  }
}

/// Runs OpenCL calls; their failures become DeviceErrors that name the step and the device.
template <typename Calls>
auto guarded(const std::string& device_name, const char* step, const Calls& calls) -> decltype(calls()) {
  try {
    return calls();
  } catch (const cl::Error& error) {
    throw DeviceError(std::string(step) + " failed on '" + device_name + "': " + error.what() + ", code " +
                          std::to_string(error.err()) + remedyFor(error.err()),
                      error.err());
  }
}

}  // namespace xray_registration

#pragma once

#include <string>

#include "xray_registration/drr/opencl/opencl_device.h"

namespace xray_registration {

/// Runs OpenCL calls; their failures become DeviceErrors that name the step and the device.
template <typename Calls>
auto guarded(const std::string& device_name, const char* step, const Calls& calls) -> decltype(calls()) {
  try {
    return calls();
  } catch (const cl::Error& error) {
    const bool no_room = error.err() == CL_MEM_OBJECT_ALLOCATION_FAILURE || error.err() == CL_OUT_OF_RESOURCES ||
                         error.err() == CL_OUT_OF_HOST_MEMORY || error.err() == CL_INVALID_BUFFER_SIZE;
    throw DeviceError(std::string(step) + " failed on '" + device_name + "': " + error.what() + ", code " +
                          std::to_string(error.err()) +
                          (no_room ? " (no room on the device: use a smaller CT or another device)" : ""),
                      error.err());
  }
}

}  // namespace xray_registration

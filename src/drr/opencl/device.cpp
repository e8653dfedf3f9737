#include "xray_registration/drr/device.h"

#include <algorithm>
#include <cctype>

#include "drr/opencl/guarded.h"
#include "drr/opencl/kernel_cache.h"
#include "xray_registration/drr/opencl/opencl_device.h"

namespace xray_registration {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Names from drivers may carry a terminating zero and padding.
std::string trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
  return text;
}

std::vector<cl::Device> allDevices() {
  useKernelCache();
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return {};  // The loader throws when no driver is installed.
  }
  std::vector<cl::Device> devices;
  for (const cl::Platform& platform : platforms) {
    std::vector<cl::Device> found;
    try {
      platform.getDevices(CL_DEVICE_TYPE_ALL, &found);
    } catch (const cl::Error&) {
      continue;  // A platform without devices.
    }
    devices.insert(devices.end(), found.begin(), found.end());
  }
  return devices;
}

bool isOfType(const cl::Device& device, cl_device_type type) { return (device.getInfo<CL_DEVICE_TYPE>() & type) != 0; }

std::string describeDevices() {
  const std::vector<std::string> names = listDevices();
  if (names.empty()) return "no OpenCL device was found (install a driver, for a CPU: apt install pocl-opencl-icd)";
  std::string text = "devices:";
  for (const std::string& name : names) text += " '" + name + "'";
  return text;
}

cl::Device chooseDevice(const std::string& choice) {
  const std::vector<cl::Device> devices = allDevices();
  const auto first_of = [&](cl_device_type type) {
    return std::find_if(devices.begin(), devices.end(), [&](const cl::Device& d) { return isOfType(d, type); });
  };
  const std::string wanted = lower(choice);
  auto chosen = devices.end();
  if (wanted == "gpu" || wanted == "auto" || wanted.empty()) chosen = first_of(CL_DEVICE_TYPE_GPU);
  if (wanted == "cpu" || ((wanted == "auto" || wanted.empty()) && chosen == devices.end())) {
    chosen = first_of(CL_DEVICE_TYPE_CPU);
  }
  if (chosen == devices.end() && wanted != "gpu" && wanted != "cpu") {
    chosen = std::find_if(devices.begin(), devices.end(), [&](const cl::Device& d) {
      return wanted == "auto" || lower(d.getInfo<CL_DEVICE_NAME>()).find(wanted) != std::string::npos;
    });
  }
  if (chosen == devices.end()) {
    throw DeviceError("no OpenCL device fits device '" + choice + "'; " + describeDevices(), 0);
  }
  return *chosen;
}

}  // namespace

std::vector<std::string> listDevices() {
  std::vector<std::string> names;
  for (const cl::Device& device : allDevices()) names.push_back(trimmed(device.getInfo<CL_DEVICE_NAME>()));
  return names;
}

Device::Device(const std::string& choice, const Logger& logger) : opencl_(std::make_unique<OpenClDevice>()) {
  const std::string cache = useKernelCache();
  if (!cache.empty()) log(logger, LogLevel::kWarning, cache);
  opencl_->device = chooseDevice(choice);
  guarded(choice, "opening the OpenCL device", [&] {
    const cl::Device& device = opencl_->device;
    name_ = trimmed(device.getInfo<CL_DEVICE_NAME>());
    opencl_->name = name_;
    opencl_->context = cl::Context(device);
    opencl_->solve_queue = cl::CommandQueue(opencl_->context, device, CL_QUEUE_PROFILING_ENABLE);
    opencl_->upload_queue = cl::CommandQueue(opencl_->context, device);
    is_gpu_ = isOfType(device, CL_DEVICE_TYPE_GPU);
    max_allocation_bytes_ = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
    global_memory_bytes_ = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    compute_units_ = static_cast<int>(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
  });
  log(logger, LogLevel::kInfo, "OpenCL device: " + name_);
}

Device::~Device() = default;

void Device::finish() const {
  guarded(name_, "waiting for the device", [&] {
    opencl_->upload_queue.finish();
    opencl_->solve_queue.finish();
  });
}

cl::Program OpenClDevice::build(const std::string& source, const std::string& options) const {
  cl::Program program(context, source);
  try {
    program.build({device}, options.c_str());
  } catch (const cl::Error& error) {
    std::string build_log;
    try {
      build_log = program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device);
    } catch (const cl::Error&) {
      build_log = "(the driver gives no build log)";
    }
    throw DeviceError("the OpenCL compiler of '" + name + "' failed with code " + std::to_string(error.err()) +
                          "; build log:\n" + build_log,
                      error.err());
  }
  return program;
}

}  // namespace xray_registration

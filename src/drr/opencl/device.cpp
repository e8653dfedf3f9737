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

struct FoundDevices {
  std::vector<cl::Device> devices;
  std::string problem;  ///< Of finding them, in words; empty when there was none.

  void note(const cl::Error& error) {
    problem = std::string("; ") + error.what() + " failed with code " + std::to_string(error.err());
  }
};

constexpr cl_int kNoPlatform = -1001;  ///< CL_PLATFORM_NOT_FOUND_KHR: the loader knows of no driver.

FoundDevices allDevices() {
  useKernelCache();
  FoundDevices all;
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error& error) {
    if (error.err() != kNoPlatform) all.note(error);
    return all;
  }
  for (const cl::Platform& platform : platforms) {
    std::vector<cl::Device> found;
    try {
      platform.getDevices(CL_DEVICE_TYPE_ALL, &found);
    } catch (const cl::Error& error) {
      if (error.err() != CL_DEVICE_NOT_FOUND) all.note(error);
      continue;
    }
    all.devices.insert(all.devices.end(), found.begin(), found.end());
  }
  return all;
}

bool isOfType(const cl::Device& device, cl_device_type type) { return (device.getInfo<CL_DEVICE_TYPE>() & type) != 0; }

std::vector<std::string> namesOf(const std::vector<cl::Device>& devices) {
  std::vector<std::string> names;
  for (const cl::Device& device : devices) {
    try {
      names.push_back(trimmed(device.getInfo<CL_DEVICE_NAME>()));
    } catch (const cl::Error&) {
      names.emplace_back("(a device that does not say its name)");
    }
  }
  return names;
}

std::string describe(const FoundDevices& found) {
  if (found.devices.empty()) {
    return "no OpenCL device was found (install a driver, for a CPU: apt install pocl-opencl-icd)" + found.problem;
  }
  std::string text = "devices:";
  for (const std::string& name : namesOf(found.devices)) text += " '" + name + "'";
  return text + found.problem;
}

cl::Device chooseDevice(const std::string& choice) {
  const FoundDevices found = allDevices();
  const std::vector<cl::Device>& devices = found.devices;
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
    throw DeviceError("no OpenCL device fits device '" + choice + "'; " + describe(found), 0);
  }
  return *chosen;
}

}  // namespace

std::vector<std::string> listDevices() { return namesOf(allDevices().devices); }

Device::Device(const std::string& choice, const Logger& logger) : opencl_(std::make_unique<OpenClDevice>()) {
  const std::string cache = useKernelCache();
  if (!cache.empty()) log(logger, LogLevel::kWarning, cache);
  guarded(choice, "opening the OpenCL device", [&] {
    opencl_->device = chooseDevice(choice);
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
  return guarded(name, "compiling the kernels", [&] {
    cl::Program program(context, source);
    // Not by the C++ bindings: where they find no log, they report that instead of the failure.
    const cl_int status = clBuildProgram(program(), 1, &device(), options.c_str(), nullptr, nullptr);
    if (status == CL_SUCCESS) return program;
    if (status != CL_BUILD_PROGRAM_FAILURE) throw cl::Error(status, "clBuildProgram");
    std::string build_log;
    try {
      build_log = program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device);
    } catch (const cl::Error&) {
      build_log = "(the driver gives no build log)";
    }
    throw DeviceError("the OpenCL compiler of '" + name + "' failed with code " + std::to_string(status) +
                          "; build log:\n" + build_log,
                      status);
  });
}

}  // namespace xray_registration

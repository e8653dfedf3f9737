#include "test/drr/opencl/failing_opencl.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <set>

#include "xray_registration/drr/opencl/opencl.h"

namespace xray_registration {
namespace failing_opencl {
namespace {

constexpr cl_int kFailure = CL_OUT_OF_RESOURCES;  ///< What drivers say of a device that is lost.

/// In the file that the environment names, or in this process alone.
Control* mappedControl() {
  static Control own;
  const char* path = std::getenv("XRAY_FAILING_OPENCL");
  if (path == nullptr) return &own;
  const int file = open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) std::abort();  // The test that named it would show nothing.
  void* memory = mmap(nullptr, sizeof(Control), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (memory == MAP_FAILED) std::abort();
  return static_cast<Control*>(memory);
}

Control& control() {
  static Control* const the_control = mappedControl();
  return *the_control;
}

std::vector<const char*>& calledFunctions() {
  static std::vector<const char*> called;
  return called;
}

std::mutex& mutex() {
  static std::mutex the_mutex;
  return the_mutex;
}

/// Counts a call and says whether it is to fail.
bool fails(const char* function) {
  const std::lock_guard<std::mutex> lock(mutex());
  Control& c = control();
  const long call = c.calls++;
  static const bool is_mapped = std::getenv("XRAY_FAILING_OPENCL") != nullptr;
  if (!is_mapped) calledFunctions().push_back(function);
  if (c.first < 0 || call < c.first || c.failed >= c.times) return false;
  ++c.failed;
  std::strncpy(c.last, function, sizeof(c.last) - 1);
  return true;
}

/// The library's own function.
template <typename Function>
Function* real(const char* function) {
  static void* const library = dlopen("libOpenCL.so.1", RTLD_NOW | RTLD_LOCAL);
  void* found = library == nullptr ? nullptr : dlsym(library, function);
  if (found == nullptr) std::abort();
  return reinterpret_cast<Function*>(found);
}

}  // namespace

void failFrom(long first, long times) {
  const std::lock_guard<std::mutex> lock(mutex());
  control() = {};
  calledFunctions().clear();
  control().first = first;
  control().times = times;
}

void heal() { failFrom(-1); }

long calls() {
  const std::lock_guard<std::mutex> lock(mutex());
  return control().calls;
}

long failures() {
  const std::lock_guard<std::mutex> lock(mutex());
  return control().failed;
}

std::string lastFailed() {
  const std::lock_guard<std::mutex> lock(mutex());
  return control().last;
}

std::vector<std::string> functions() {
  const std::lock_guard<std::mutex> lock(mutex());
  return {calledFunctions().begin(), calledFunctions().end()};
}

std::vector<long> callsToFail(const std::vector<std::string>& functions) {
  std::map<std::string, std::vector<long>> of_each;
  for (std::size_t i = 0; i < functions.size(); ++i) of_each[functions[i]].push_back(static_cast<long>(i));
  std::set<long> chosen;
  for (const auto& [function, calls] : of_each) {
    if (std::getenv("XRAY_REGISTRATION_EVERY_CALL") != nullptr) {
      chosen.insert(calls.begin(), calls.end());
    } else {
      chosen.insert({calls.front(), calls[calls.size() / 2], calls.back()});
    }
  }
  return {chosen.begin(), chosen.end()};
}

}  // namespace failing_opencl
}  // namespace xray_registration

namespace {
using xray_registration::failing_opencl::fails;
using xray_registration::failing_opencl::kFailure;
using xray_registration::failing_opencl::real;
}  // namespace

// A call that fails does nothing (what is not released leaks), but what waits has waited: an error ends nothing that is
// under way.
#define XRAY_REAL(name) real<decltype(name)>(#name)

#define XRAY_STATUS(name, parameters, arguments) \
  CL_API_ENTRY cl_int CL_API_CALL name parameters { return fails(#name) ? kFailure : XRAY_REAL(name) arguments; }

#define XRAY_AFTER_WAITING(name, parameters, arguments) \
  CL_API_ENTRY cl_int CL_API_CALL name parameters {     \
    const cl_int status = XRAY_REAL(name) arguments;    \
    return fails(#name) ? kFailure : status;            \
  }

#define XRAY_OBJECT(type, name, parameters, arguments, status) \
  CL_API_ENTRY type CL_API_CALL name parameters {              \
    if (!fails(#name)) return XRAY_REAL(name) arguments;       \
    if ((status) != nullptr) *(status) = kFailure;             \
    return nullptr;                                            \
  }

extern "C" {

XRAY_STATUS(clGetPlatformIDs, (cl_uint n, cl_platform_id* all, cl_uint* count), (n, all, count))
XRAY_STATUS(clGetDeviceIDs, (cl_platform_id p, cl_device_type t, cl_uint n, cl_device_id* all, cl_uint* count),
            (p, t, n, all, count))
XRAY_STATUS(clGetDeviceInfo, (cl_device_id d, cl_device_info i, size_t n, void* to, size_t* size), (d, i, n, to, size))
XRAY_OBJECT(cl_context, clCreateContext,
            (const cl_context_properties* p, cl_uint n, const cl_device_id* d,
             void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* data, cl_int* status),
            (p, n, d, notify, data, status), status)
XRAY_OBJECT(cl_command_queue, clCreateCommandQueue,
            (cl_context c, cl_device_id d, cl_command_queue_properties p, cl_int* status), (c, d, p, status), status)
XRAY_OBJECT(cl_mem, clCreateBuffer, (cl_context c, cl_mem_flags f, size_t n, void* host, cl_int* status),
            (c, f, n, host, status), status)
XRAY_OBJECT(cl_program, clCreateProgramWithSource,
            (cl_context c, cl_uint n, const char** texts, const size_t* sizes, cl_int* status),
            (c, n, texts, sizes, status), status)
XRAY_STATUS(clBuildProgram,
            (cl_program p, cl_uint n, const cl_device_id* d, const char* options,
             void(CL_CALLBACK* notify)(cl_program, void*), void* data),
            (p, n, d, options, notify, data))
XRAY_STATUS(clGetProgramInfo, (cl_program p, cl_program_info i, size_t n, void* to, size_t* size), (p, i, n, to, size))
XRAY_STATUS(clGetProgramBuildInfo,
            (cl_program p, cl_device_id d, cl_program_build_info i, size_t n, void* to, size_t* size),
            (p, d, i, n, to, size))
XRAY_OBJECT(cl_kernel, clCreateKernel, (cl_program p, const char* name, cl_int* status), (p, name, status), status)
XRAY_STATUS(clSetKernelArg, (cl_kernel k, cl_uint i, size_t n, const void* value), (k, i, n, value))
XRAY_STATUS(clEnqueueNDRangeKernel,
            (cl_command_queue q, cl_kernel k, cl_uint dimensions, const size_t* offset, const size_t* items,
             const size_t* group, cl_uint n, const cl_event* wait, cl_event* event),
            (q, k, dimensions, offset, items, group, n, wait, event))
XRAY_STATUS(clEnqueueReadBuffer,
            (cl_command_queue q, cl_mem m, cl_bool b, size_t at, size_t n, void* to, cl_uint w, const cl_event* wait,
             cl_event* event),
            (q, m, b, at, n, to, w, wait, event))
XRAY_STATUS(clEnqueueWriteBuffer,
            (cl_command_queue q, cl_mem m, cl_bool b, size_t at, size_t n, const void* from, cl_uint w,
             const cl_event* wait, cl_event* event),
            (q, m, b, at, n, from, w, wait, event))
XRAY_STATUS(clEnqueueCopyBuffer,
            (cl_command_queue q, cl_mem from, cl_mem to, size_t at, size_t to_at, size_t n, cl_uint w,
             const cl_event* wait, cl_event* event),
            (q, from, to, at, to_at, n, w, wait, event))
XRAY_STATUS(clEnqueueFillBuffer,
            (cl_command_queue q, cl_mem m, const void* pattern, size_t size, size_t at, size_t n, cl_uint w,
             const cl_event* wait, cl_event* event),
            (q, m, pattern, size, at, n, w, wait, event))
XRAY_OBJECT(void*, clEnqueueMapBuffer,
            (cl_command_queue q, cl_mem m, cl_bool b, cl_map_flags f, size_t at, size_t n, cl_uint w,
             const cl_event* wait, cl_event* event, cl_int* status),
            (q, m, b, f, at, n, w, wait, event, status), status)
XRAY_STATUS(clEnqueueUnmapMemObject,
            (cl_command_queue q, cl_mem m, void* at, cl_uint w, const cl_event* wait, cl_event* event),
            (q, m, at, w, wait, event))
XRAY_AFTER_WAITING(clWaitForEvents, (cl_uint n, const cl_event* all), (n, all))
XRAY_AFTER_WAITING(clFinish, (cl_command_queue q), (q))
XRAY_STATUS(clGetEventProfilingInfo, (cl_event e, cl_profiling_info i, size_t n, void* to, size_t* size),
            (e, i, n, to, size))
XRAY_STATUS(clRetainDevice, (cl_device_id d), (d))
XRAY_STATUS(clReleaseDevice, (cl_device_id d), (d))
XRAY_STATUS(clReleaseContext, (cl_context c), (c))
XRAY_STATUS(clReleaseCommandQueue, (cl_command_queue q), (q))
XRAY_STATUS(clReleaseMemObject, (cl_mem m), (m))
XRAY_STATUS(clReleaseProgram, (cl_program p), (p))
XRAY_STATUS(clReleaseKernel, (cl_kernel k), (k))
XRAY_STATUS(clReleaseEvent, (cl_event e), (e))

}  // extern "C"

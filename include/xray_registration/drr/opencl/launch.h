#pragma once

#include <cstddef>

#include "xray_registration/drr/opencl/opencl.h"

namespace xray_registration {

/// Sets all arguments of a kernel, in its own order.
template <typename... Arguments>
void setArgs(cl::Kernel* kernel, const Arguments&... arguments) {
  cl_uint index = 0;
  (kernel->setArg(index++, arguments), ...);
}

/// How many work-items run, in groups of how many, and the event that is told when they are done (or null).
struct LaunchRange {
  cl::NDRange items;
  cl::NDRange group;
  cl::Event* event = nullptr;
};

/// `groups` groups of `group` work-items.
inline LaunchRange groupsOf(std::size_t group, std::size_t groups, cl::Event* event = nullptr) {
  return {cl::NDRange(groups * group), cl::NDRange(group), event};
}

/// At least `items` work-items; the last group is filled, because PoCL refuses groups that are not full.
inline LaunchRange atLeast(std::size_t items, std::size_t group) {
  return groupsOf(group, (items + group - 1) / group);
}

/// Enqueues a kernel with all its arguments.
template <typename... Arguments>
void launch(const cl::CommandQueue& queue, cl::Kernel* kernel, const LaunchRange& range,
            const Arguments&... arguments) {
  setArgs(kernel, arguments...);
  queue.enqueueNDRangeKernel(*kernel, cl::NullRange, range.items, range.group, nullptr, range.event);
}

}  // namespace xray_registration

#pragma once

#include <memory>
#include <vector>

#include "tools/benchmark/measure.h"
#include "xray_registration/drr/device.h"

namespace xray_registration::tools {

/// One Gauss-Newton step at N³ CT and N² image, everything in it, all in turns: step/paper/cpp/128,
/// step/paper/opencl/128, step/fast/128, step/fast/256.
std::vector<BenchmarkRow> measureSteps(const std::shared_ptr<Device>& device, int rounds);

/// One DRR of 200² from 256³: drr/fast/200, and drr/paper/opencl/200 beside it.
std::vector<BenchmarkRow> measureDrr(const std::shared_ptr<Device>& device, int rounds);

/// A CT of 256³ to the device, pyramid included: upload/256.
std::vector<BenchmarkRow> measureUpload(const std::shared_ptr<Device>& device, int rounds);

/// Device bytes of a 512³ CT, pyramid included, and its ratio to the CT's 16-bit size: memory/512.
BenchmarkRow measureMemory(const std::shared_ptr<Device>& device);

}  // namespace xray_registration::tools

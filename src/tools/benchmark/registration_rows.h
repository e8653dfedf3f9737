#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tools/benchmark/measure.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration::tools {

/// Whole registrations of the fast method from Table II's three starts, in turns: <prefix>/2, /4, /6. The volume and
/// the geometry are Table II's; the portal image is a line-integral DRR of the paper's ray caster at the truth. The
/// note holds steps and errors.
std::vector<BenchmarkRow> measureRegistrations(const std::string& prefix, const std::shared_ptr<Device>& device,
                                               const AttenuationVolume& volume, int rounds);

}  // namespace xray_registration::tools

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tools/benchmark/measure.h"
#include "xray_registration/drr/device.h"

namespace xray_registration::tools {

/// How times grow, one thing at a time, each curve in turns:
///   growth/ct/<N>/{step,drr}     N³ CT for 256² images
///   growth/image/<N>/{step,drr}  N² image of a 256³ CT
///   growth/views/<V>/{step,frame}  V views of 256², CT 256³: a step over all of them, and a whole tracked frame
/// `quick` leaves out what is above 256.
std::vector<BenchmarkRow> measureGrowth(const std::shared_ptr<Device>& device, int rounds, bool quick);

/// Whole tracked frames, upload of the X-ray in it, 1° and 1 mm from the start: frame/fast/256, and frame/fast/512
/// unless `quick` (N³ CT, N² image).
std::vector<BenchmarkRow> measureFrames(const std::shared_ptr<Device>& device, int rounds, bool quick);

}  // namespace xray_registration::tools

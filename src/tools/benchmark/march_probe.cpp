#include "tools/benchmark/march_probe.h"

#include <algorithm>
#include <string>
#include <vector>

#include "drr/pose_parameters.h"

namespace xray_registration::kernels {
extern const char* const fast;
extern const char* const ceiling;
}  // namespace xray_registration::kernels

namespace xray_registration::tools {
namespace {

// Mirrors of fast.cl.
constexpr int kTile = 8;
constexpr int kRays = 64;
constexpr std::size_t kCopyGroup = 64;

double eventMs(const cl::Event& event) {
  event.wait();
  return 1e-6 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                    event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
}

}  // namespace

MarchProbe::MarchProbe(std::shared_ptr<Device> device) : device_(std::move(device)) {
  const int lanes = device_->isGpu() ? 1 : kRays;
  items_per_tile_ = static_cast<std::size_t>(kRays / lanes);
  program_ =
      device_->build(std::string(kernels::fast) + kernels::ceiling,
                     "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -DSPLIT=1 -DLANES=" + std::to_string(lanes));
  plan_ = cl::Kernel(program_, "plan");
  loads_only_ = cl::Kernel(program_, "loads_only");
  copy_ = cl::Kernel(program_, "copy");
}

void MarchProbe::plan(const ResidentLevel& level, const XrayCamera& camera, const RigidTransform& T_camera_ct,
                      const Eigen::Vector3d& centre_ct_mm) {
  cl::CommandQueue& queue = device_->solveQueue();
  level_ = &level;
  tiles_x_ = (camera.width + kTile - 1) / kTile;
  tiles_ = tiles_x_ * ((camera.height + kTile - 1) / kTile);
  const auto tiles = static_cast<std::size_t>(tiles_);
  const PoseParameters pose = poseParameters(level, camera, T_camera_ct, T_camera_ct * centre_ct_mm);
  poses_ = cl::Buffer(device_->context(), CL_MEM_READ_ONLY, sizeof(float) * pose.size());
  queue.enqueueWriteBuffer(poses_, CL_TRUE, 0, sizeof(float) * pose.size(), pose.data());
  std::vector<cl_int> used(tiles, 1);
  const cl::Buffer used_tiles(device_->context(), CL_MEM_READ_ONLY, sizeof(cl_int) * tiles);
  queue.enqueueWriteBuffer(used_tiles, CL_TRUE, 0, sizeof(cl_int) * tiles, used.data());
  plans_ = cl::Buffer(device_->context(), CL_MEM_READ_WRITE, sizeof(cl_int4) * tiles);
  out_ = cl::Buffer(device_->context(), CL_MEM_WRITE_ONLY, sizeof(cl_uint) * kRays * tiles);
  plan_.setArg(0, level.occupancy);
  plan_.setArg(1, level.grid);
  plan_.setArg(2, poses_);
  plan_.setArg(3, tiles_x_);
  plan_.setArg(4, tiles_);
  plan_.setArg(5, used_tiles);
  plan_.setArg(6, plans_);
  queue.enqueueNDRangeKernel(plan_, cl::NullRange, cl::NDRange(tiles * items_per_tile_), cl::NDRange(items_per_tile_));
  queue.finish();
  countSamples(camera);
}

void MarchProbe::countSamples(const XrayCamera& camera) {
  std::vector<cl_int4> plans(static_cast<std::size_t>(tiles_));
  device_->solveQueue().enqueueReadBuffer(plans_, CL_TRUE, 0, sizeof(cl_int4) * plans.size(), plans.data());
  samples_ = 0.0;
  loaded_bytes_ = 0.0;
  for (int tile = 0; tile < tiles_; ++tile) {
    const cl_int4& plan = plans[static_cast<std::size_t>(tile)];
    const int columns = std::min(kTile, camera.width - tile % tiles_x_ * kTile);
    const int rows = std::min(kTile, camera.height - tile / tiles_x_ * kTile);
    const double samples = static_cast<double>(columns * rows) * std::max(0, plan.s[2] - plan.s[1] + 1);
    samples_ += samples;
    loaded_bytes_ += samples * sizeof(cl_uint) * (plan.s[0] == 2 ? 4 : 2);
  }
}

double MarchProbe::loadsOnlyMs() {
  loads_only_.setArg(0, level_->words);
  loads_only_.setArg(1, level_->grid);
  loads_only_.setArg(2, poses_);
  loads_only_.setArg(3, plans_);
  loads_only_.setArg(4, tiles_x_);
  loads_only_.setArg(5, tiles_);
  loads_only_.setArg(6, out_);
  cl::Event event;
  device_->solveQueue().enqueueNDRangeKernel(loads_only_, cl::NullRange,
                                             cl::NDRange(static_cast<std::size_t>(tiles_) * items_per_tile_),
                                             cl::NDRange(items_per_tile_), nullptr, &event);
  return eventMs(event);
}

double MarchProbe::copyBytesPerSecond(std::size_t bytes) {
  const std::size_t items = bytes / sizeof(cl_float16) / kCopyGroup * kCopyGroup;
  const std::size_t size = items * sizeof(cl_float16);
  const cl::Buffer from(device_->context(), CL_MEM_READ_WRITE, size);
  const cl::Buffer to(device_->context(), CL_MEM_READ_WRITE, size);
  cl::CommandQueue& queue = device_->solveQueue();
  // Pages that were never written may all be one and the same page of zeros.
  queue.enqueueFillBuffer(from, 1.0F, 0, size);
  queue.enqueueFillBuffer(to, 1.0F, 0, size);
  queue.finish();
  copy_.setArg(0, from);
  copy_.setArg(1, to);
  double best_ms = 0.0;
  for (int run = 0; run < 5; ++run) {
    cl::Event event;
    queue.enqueueNDRangeKernel(copy_, cl::NullRange, cl::NDRange(items), cl::NDRange(kCopyGroup), nullptr, &event);
    const double ms = eventMs(event);
    if (run == 0 || ms < best_ms) best_ms = ms;
  }
  return 2.0 * static_cast<double>(size) / (best_ms * 1e-3);
}

}  // namespace xray_registration::tools

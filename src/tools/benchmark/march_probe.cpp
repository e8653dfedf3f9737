#include "tools/benchmark/march_probe.h"

#include <algorithm>
#include <string>
#include <vector>

#include "xray_registration/drr/opencl/fast_program.h"
#include "xray_registration/drr/opencl/launch.h"
#include "xray_registration/drr/opencl/pose_parameters.h"

namespace xray_registration::kernels {
extern const char* const ceiling;
}  // namespace xray_registration::kernels

namespace xray_registration::tools {
namespace {

using layout::kRays;
using layout::kTile;
constexpr std::size_t kCopyGroup = 64;

double eventMs(const cl::Event& event) {
  event.wait();
  return 1e-6 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                    event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
}

}  // namespace

MarchProbe::MarchProbe(std::shared_ptr<Device> device) : device_(std::move(device)) {
  const MarchShape shape{device_->isGpu() ? 1 : kRays, 1, hasVoxels16(*device_)};
  items_per_tile_ = shape.itemsPerTile();
  program_ = device_->openCl().build(fastSource() + kernels::ceiling, fastOptions(shape));
  plan_ = cl::Kernel(program_, "plan");
  loads_only_ = cl::Kernel(program_, "loads_only");
  copy_ = cl::Kernel(program_, "copy");
}

void MarchProbe::plan(const Engine& engine, const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  const OpenClLevel& level = openClVolume(engine).levels().front();
  const cl::CommandQueue& queue = device_->openCl().solve_queue;
  level_ = &level;
  tiles_x_ = layout::tilesFor(camera.width);
  tiles_ = tiles_x_ * layout::tilesFor(camera.height);
  const auto tiles = static_cast<std::size_t>(tiles_);
  const PoseParameters pose = poseParameters(level, camera, T_camera_ct, T_camera_ct * engine.volume().centreCt());
  poses_ = cl::Buffer(device_->openCl().context, CL_MEM_READ_ONLY, sizeof(float) * pose.size());
  queue.enqueueWriteBuffer(poses_, CL_TRUE, 0, sizeof(float) * pose.size(), pose.data());
  std::vector<cl_int> used(tiles, 1);
  const cl::Buffer used_tiles(device_->openCl().context, CL_MEM_READ_ONLY, sizeof(cl_int) * tiles);
  queue.enqueueWriteBuffer(used_tiles, CL_TRUE, 0, sizeof(cl_int) * tiles, used.data());
  plans_ = cl::Buffer(device_->openCl().context, CL_MEM_READ_WRITE, sizeof(cl_int4) * tiles);
  out_ = cl::Buffer(device_->openCl().context, CL_MEM_WRITE_ONLY, sizeof(cl_uint) * kRays * tiles);
  launch(queue, &plan_, groupsOf(items_per_tile_, tiles), level.occupancy, level.grid, poses_, tiles_x_, tiles_,
         used_tiles, plans_);
  queue.finish();
  countSamples(camera);
}

std::vector<cl_int4> MarchProbe::plans() const {
  std::vector<cl_int4> plans(static_cast<std::size_t>(tiles_));
  device_->openCl().solve_queue.enqueueReadBuffer(plans_, CL_TRUE, 0, sizeof(cl_int4) * plans.size(), plans.data());
  return plans;
}

void MarchProbe::countSamples(const XrayCamera& camera) {
  const std::vector<cl_int4> plans = this->plans();
  samples_ = 0.0;
  loaded_bytes_ = 0.0;
  for (int tile = 0; tile < tiles_; ++tile) {
    const cl_int4& plan = plans[static_cast<std::size_t>(tile)];
    const int columns = std::min(kTile, camera.width - tile % tiles_x_ * kTile);
    const int rows = std::min(kTile, camera.height - tile / tiles_x_ * kTile);
    const double samples = static_cast<double>(columns * rows) * std::max(0, plan.s[2] - plan.s[1] + 1);
    samples_ += samples;
    loaded_bytes_ += samples * sizeof(cl_uint) * (plan.s[0] == 2 && level_->grid.has_voxels == 0 ? 4 : 2);
  }
}

double MarchProbe::loadsOnlyMs() {
  cl::Event event;
  launch(device_->openCl().solve_queue, &loads_only_,
         groupsOf(items_per_tile_, static_cast<std::size_t>(tiles_), &event), level_->words, level_->grid, poses_,
         plans_, tiles_x_, tiles_, out_);
  return eventMs(event);
}

double MarchProbe::copyBytesPerSecond(std::size_t bytes) {
  const std::size_t items = bytes / sizeof(cl_float16) / kCopyGroup * kCopyGroup;
  const std::size_t size = items * sizeof(cl_float16);
  const cl::Buffer from(device_->openCl().context, CL_MEM_READ_WRITE, size);
  const cl::Buffer to(device_->openCl().context, CL_MEM_READ_WRITE, size);
  const cl::CommandQueue& queue = device_->openCl().solve_queue;
  // Pages that were never written may all be one and the same page of zeros.
  queue.enqueueFillBuffer(from, 1.0F, 0, size);
  queue.enqueueFillBuffer(to, 1.0F, 0, size);
  queue.finish();
  double best_ms = 0.0;
  for (int run = 0; run < 5; ++run) {
    cl::Event event;
    launch(queue, &copy_, groupsOf(kCopyGroup, items / kCopyGroup, &event), from, to);
    const double ms = eventMs(event);
    if (run == 0 || ms < best_ms) best_ms = ms;
  }
  return 2.0 * static_cast<double>(size) / (best_ms * 1e-3);
}

}  // namespace xray_registration::tools

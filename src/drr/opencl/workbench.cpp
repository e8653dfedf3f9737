#include "drr/opencl/workbench.h"

#include <algorithm>
#include <utility>

#include "drr/opencl/guarded.h"
#include "xray_registration/drr/opencl/fast_program.h"
#include "xray_registration/drr/opencl/opencl_volume.h"

namespace xray_registration {

Workbench::Workbench(std::shared_ptr<Device> device) : device_(std::move(device)) { kernels(); }

FastKernels& Workbench::kernels(int split) {
  const auto found = kernels_.find(split);
  if (found != kernels_.end()) return found->second;
  return guarded(device_->name(), "compiling the kernels", [&]() -> FastKernels& {
    FastKernels k;
    const MarchShape shape{device_->isGpu() || split > 1 ? 1 : layout::kRays, split, hasVoxels16(*device_)};
    k.items_per_tile = shape.itemsPerTile();
    k.program = device_->openCl().build(fastSource(), fastOptions(shape));
    k.plan = cl::Kernel(k.program, "plan");
    k.render = cl::Kernel(k.program, "render");
    k.render_derivatives = cl::Kernel(k.program, "render_derivatives");
    for (const SimilarityKind& kind : kSimilarities) k.sums.emplace_back(k.program, kind.sums);
    k.motion_sums = cl::Kernel(k.program, "motion_sums");
    k.body_sums = cl::Kernel(k.program, "body_sums");
    k.windows = cl::Kernel(k.program, "windows");
    k.halve_xray = cl::Kernel(k.program, "halve_xray");
    k.used_tiles = cl::Kernel(k.program, "used_tiles");
    k.leave_out_tiles = cl::Kernel(k.program, "leave_out_tiles");
    k.surround = cl::Kernel(k.program, "surround");
    k.unexplained = cl::Kernel(k.program, "unexplained");
    k.apply_map = cl::Kernel(k.program, "apply_map");
    k.outline = cl::Kernel(k.program, "outline");
    k.match_everywhere = cl::Kernel(k.program, "match_everywhere");
    k.match_shown = cl::Kernel(k.program, "match_shown");
    return kernels_.emplace(split, std::move(k)).first->second;
  });
}

void Workbench::settle() const noexcept {
  try {
    queue().finish();
  } catch (const cl::Error&) {
    // A device that is lost does not work on anything either.
  }
}

cl::Buffer Workbench::newBuffer(std::size_t bytes) {
  ++work_.buffers;
  return cl::Buffer(device_->openCl().context, CL_MEM_READ_WRITE, bytes);
}

const cl::Buffer& GrowingBuffer::atLeast(std::size_t bytes, Workbench* bench) {
  if (bytes_ < bytes) {
    // What grows once, grows again: the size of a crop follows the pose.
    const std::size_t wanted = std::max(bytes, bytes_ + bytes_ / 4);
    bytes_ = 0;              // Until it is there.
    buffer_ = cl::Buffer();  // The old one is released before the new one is made.
    buffer_ = bench->newBuffer(wanted);
    bytes_ = wanted;
  }
  return buffer_;
}

std::vector<float>& Staging::refill() {
  const cl::Event written = std::exchange(written_, cl::Event());
  if (written() != nullptr) written.wait();
  return floats_;
}

const cl::Buffer& Staging::writeTo(GrowingBuffer* buffer, Workbench* bench) {
  const std::size_t bytes = sizeof(float) * floats_.size();
  const cl::Buffer& target = buffer->atLeast(bytes, bench);
  bench->queue().enqueueWriteBuffer(target, CL_FALSE, 0, bytes, floats_.data(), nullptr, &written_);
  return target;
}

}  // namespace xray_registration

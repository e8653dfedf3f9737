#include "drr/opencl/xray_pixels.h"

#include <new>
#include <utility>

namespace xray_registration {
namespace {

/// Of one image of floats.
std::size_t bytesOf(const XrayCamera& camera) {
  return sizeof(float) * static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

}  // namespace

XrayPixels::XrayPixels(const std::vector<ResidentXray::Level>& levels, const FloatImage& attenuation,
                       const FloatImage& weight, std::shared_ptr<SpareStorage> spares, Workbench* bench)
    : levels_(levels), spares_(std::move(spares)), storage_(takenFrom(&spares_->pixels)) {
  if (storage_->levels.size() < levels_.size()) storage_->levels.resize(levels_.size());
  const std::size_t bytes = bytesOf(cameraOf(0));
  bench->queue().enqueueWriteBuffer(storageOf(0).attenuation.atLeast(bytes, bench), CL_FALSE, 0, bytes,
                                    attenuation.pixels.data());
  try {
    bench->queue().enqueueWriteBuffer(storage_->mask.atLeast(bytes, bench), CL_TRUE, 0, bytes, weight.pixels.data());
  } catch (const cl::Error&) {
    bench->settle();  // The caller's pixels are still being read.
    throw;
  }
}

XrayPixels::~XrayPixels() { giveTo(&spares_->pixels, std::move(storage_)); }

const cl::Buffer& XrayPixels::weight(int level) const {
  return level == 0 && !weighed_ ? storage_->mask.get() : storageOf(level).weight.get();
}

void XrayPixels::restoreWeights() {
  if (!weighed_) return;
  weighed_ = false;
  ready_levels_ = 0;
  ++revision_;
}

void XrayPixels::weigh(const cl::Buffer& map, int map_width, int map_height, Workbench* bench) {
  const XrayCamera& camera = cameraOf(0);
  FastKernels& k = bench->kernels();
  bench->run(&k.apply_map, k.perRay(k.wholeLanes(camera.width) * camera.height), storage_->mask.get(), map,
             camera.width, camera.height, map_width, map_height, storageOf(0).weight.atLeast(bytesOf(camera), bench));
  weighed_ = true;
  ready_levels_ = 0;
  ++revision_;
}

void XrayPixels::makeReady(int level, Workbench* bench) {
  for (; ready_levels_ <= level; ++ready_levels_) {
    if (ready_levels_ > 0) halveInto(ready_levels_, bench);
  }
}

void XrayPixels::halveInto(int level, Workbench* bench) {
  const XrayCamera& fine = cameraOf(level - 1);
  const XrayCamera& half = cameraOf(level);
  PixelStorage::Level& storage = storageOf(level);
  bench->run(&bench->kernels().halve_xray, perItem(half.width * half.height), attenuation(level - 1), weight(level - 1),
             fine.width, fine.height, half.width, half.height, storage.attenuation.atLeast(bytesOf(half), bench),
             storage.weight.atLeast(bytesOf(half), bench));
  bench->countHalving();
}

}  // namespace xray_registration

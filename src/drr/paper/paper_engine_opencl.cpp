#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "drr/opencl/guarded.h"
#include "drr/paper/paper_filter.h"
#include "xray_registration/drr/opencl/launch.h"
#include "xray_registration/drr/paper/paper_engine.h"

namespace xray_registration {

namespace kernels {
extern const char* const paper;
}

namespace {

constexpr int kTile = 8;           // 8×8 work-groups: neighbouring rays share voxels.
constexpr int kReduceGroup = 64;   // PAPER_GROUP for the kernels.
constexpr int kReduceGroups = 64;  // Fixed, so that the order of summation does not depend on the device.
constexpr int kSums = 45;          // PAPER_SUMS for the kernels.

cl_float4 float4(const Eigen::Vector3f& v) { return {{v.x(), v.y(), v.z(), 0.0F}}; }
std::size_t padded(int size) { return static_cast<std::size_t>((size + kTile - 1) / kTile * kTile); }

class PaperEngineOpenCl : public PaperEngine {
 public:
  explicit PaperEngineOpenCl(std::shared_ptr<Device> device) : device_(std::move(device)) {
    program_ = device_->openCl().build(kernels::paper,
                                       "-cl-std=CL1.2 -cl-mad-enable -DPAPER_GROUP=" + std::to_string(kReduceGroup) +
                                           " -DPAPER_SUMS=" + std::to_string(kSums));
    guarded(name(), "paper method, creating kernels", [&] {
      drr_ = cl::Kernel(program_, "paper_drr");
      blur_rows_ = cl::Kernel(program_, "paper_blur_rows");
      blur_columns_ = cl::Kernel(program_, "paper_blur_columns");
      weigh_ = cl::Kernel(program_, "paper_weigh");
      moments_ = cl::Kernel(program_, "paper_moments");
      partial_sums_ = cl::Buffer(device_->openCl().context, CL_MEM_READ_WRITE, sizeof(float) * kReduceGroups * kSums);
    });
  }

  void setVolume(const AttenuationVolume& volume) override {
    grid_ = volume.grid;
    row_ = grid_.size.x() + 2;
    slice_ = row_ * (grid_.size.y() + 2);
    const std::size_t voxels = static_cast<std::size_t>(slice_) * static_cast<std::size_t>(grid_.size.z() + 2);
    if (voxels * sizeof(float) > device_->maxAllocationBytes() || voxels > 0x7fffffffU) {
      throw DeviceError("paper method: the CT needs " + std::to_string(voxels * sizeof(float) >> 20U) +
                            " MiB in one piece, '" + name() + "' gives " +
                            std::to_string(device_->maxAllocationBytes() >> 20U) + " MiB: use a smaller CT",
                        0);
    }
    volume_ = cl::Buffer();  // The previous one is released before the next is made.
    volume_bytes_ = voxels * sizeof(float);
    guarded(name(), "paper method, uploading the CT", [&] {
      volume_ = cl::Buffer(device_->openCl().context, CL_MEM_READ_ONLY, volume_bytes_);
      uploadSlices(volume);
    });
  }

  void setTarget(const FloatImage& target, const MaskImage& mask, const PaperFilter& filter) override {
    const FloatImage weights = weightsOf(mask, target.width, target.height);
    smooth_ = Blur{gaussianTaps(filter.smooth_sigma_px), {}, {}};
    background_ = Blur{gaussianTaps(filter.background_sigma_px), {}, {}};
    guarded(name(), "paper method, uploading the X-ray", [&] {
      resize(target.width, target.height);
      write(weights_, weights.pixels);
      write(target_, target.pixels);
      prepare(&smooth_, weights);
      prepare(&background_, weights);
      filter_ = !smooth_.half_taps.empty() || !background_.half_taps.empty();
      if (filter_) {
        applyFilter(target_, 1);
        device_->openCl().solve_queue.enqueueCopyBuffer(filtered_, target_, 0, 0, sizeof(float) * pixels());
      }
      device_->openCl().solve_queue.finish();
    });
  }

  void render(int slot, const PaperRays& rays) override {
    if (rays.width != width_ || rays.height != height_ || volume_() == nullptr || slot < 0 || slot >= kPaperSlots) {
      throw std::logic_error("paper engine: setVolume and setTarget come before render, with one image size");
    }
    Eigen::Vector3f upper;
    for (int axis = 0; axis < 3; ++axis) {
      upper[axis] = std::nextafter(static_cast<float>(grid_.size[axis] + 1), 0.0F);
    }
    const Eigen::Vector3f origin = rays.origin + Eigen::Vector3f::Ones();  // One layer of air.
    guarded(name(), "paper method, rendering", [&] {
      launch(device_->openCl().solve_queue, &drr_,
             {cl::NDRange(padded(width_), padded(height_)), cl::NDRange(kTile, kTile)}, volume_, row_, slice_,
             float4(upper), float4(origin), float4(rays.corner), float4(rays.column), float4(rays.row),
             cl_float4{{rays.cx, rays.cy, rays.inverse_fx, rays.inverse_fy}}, rays.first_mm, rays.step_mm, rays.samples,
             rays.scale, width_, height_, images_, slot);
    });
  }

  void finish() override {
    guarded(name(), "paper method, waiting", [&] { device_->openCl().solve_queue.finish(); });
  }

  FloatImage read(int slot) override {
    FloatImage image(width_, height_);
    guarded(name(), "paper method, reading an image", [&] {
      device_->openCl().solve_queue.enqueueReadBuffer(images_, CL_TRUE,
                                                      sizeof(float) * pixels() * static_cast<unsigned>(slot),
                                                      sizeof(float) * pixels(), image.pixels.data());
    });
    return image;
  }

  PaperMoments moments(const std::array<double, 6>& steps) override {
    cl_float8 inverse_steps{};
    for (std::size_t k = 0; k < 6; ++k) inverse_steps.s[k] = static_cast<float>(1.0 / steps[k]);
    std::vector<float> parts(static_cast<std::size_t>(kReduceGroups) * kSums);
    guarded(name(), "paper method, reducing", [&] {
      if (filter_) applyFilter(images_, kPaperSlots);
      launch(device_->openCl().solve_queue, &moments_, groupsOf(kReduceGroup, kReduceGroups),
             filter_ ? filtered_ : images_, target_, weights_, inverse_steps, static_cast<int>(pixels()),
             partial_sums_);
      device_->openCl().solve_queue.enqueueReadBuffer(partial_sums_, CL_TRUE, 0, sizeof(float) * parts.size(),
                                                      parts.data());
    });
    return momentsFrom(parts);
  }

  const VolumeGrid& grid() const override { return grid_; }
  std::string name() const override { return device_->name(); }
  std::size_t deviceBytes() const override {
    return volume_bytes_ + sizeof(float) * (pixels() * (3 * kPaperSlots + 4) + kReduceGroups * kSums);
  }

 private:
  struct Blur {
    std::vector<float> half_taps;
    cl::Buffer taps;
    cl::Buffer norm;
  };

  static PaperMoments momentsFrom(const std::vector<float>& parts) {
    PaperMoments moments = PaperMoments::Zero();
    std::size_t n = 0;
    for (int a = 0; a < 9; ++a) {
      for (int b = a; b < 9; ++b, ++n) {
        double sum = 0.0;
        for (std::size_t group = 0; group < kReduceGroups; ++group) sum += parts[group * kSums + n];
        moments(a, b) = moments(b, a) = sum;
      }
    }
    return moments;
  }

  std::size_t pixels() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }

  void write(const cl::Buffer& buffer, const std::vector<float>& values) {
    device_->openCl().solve_queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, sizeof(float) * values.size(), values.data());
  }

  /// Slice by slice: no second float copy of a large CT on the host.
  void uploadSlices(const AttenuationVolume& volume) {
    std::vector<float> slice(static_cast<std::size_t>(slice_), 0.0F);
    const auto send = [&](int z) {
      device_->openCl().solve_queue.enqueueWriteBuffer(volume_, CL_TRUE,
                                                       sizeof(float) * slice.size() * static_cast<unsigned>(z),
                                                       sizeof(float) * slice.size(), slice.data());
    };
    send(0);
    send(grid_.size.z() + 1);
    const std::uint16_t* from = volume.values.data();
    for (int z = 0; z < grid_.size.z(); ++z) {
      for (int y = 0; y < grid_.size.y(); ++y) {
        float* to = slice.data() + row_ * (y + 1) + 1;
        for (int x = 0; x < grid_.size.x(); ++x) to[x] = static_cast<float>(*from++) * volume.scale_per_mm;
      }
      send(z + 1);
    }
  }

  void resize(int width, int height) {
    if (width == width_ && height == height_) return;
    width_ = width;
    height_ = height;
    const auto buffer = [&](std::size_t images) {
      return cl::Buffer(device_->openCl().context, CL_MEM_READ_WRITE, sizeof(float) * pixels() * images);
    };
    images_ = buffer(kPaperSlots);
    filtered_ = buffer(kPaperSlots);
    rows_ = buffer(kPaperSlots);
    target_ = buffer(1);
    weights_ = buffer(1);
    device_->openCl().solve_queue.enqueueFillBuffer(images_, 0.0F, 0, sizeof(float) * pixels() * kPaperSlots);
  }

  void prepare(Blur* blur, const FloatImage& weights) {
    if (blur->half_taps.empty()) return;
    blur->taps = cl::Buffer(device_->openCl().context, CL_MEM_READ_ONLY, sizeof(float) * blur->half_taps.size());
    blur->norm = cl::Buffer(device_->openCl().context, CL_MEM_READ_ONLY, sizeof(float) * pixels());
    write(blur->taps, blur->half_taps);
    write(blur->norm, inverseBlurredWeights(weights, blur->half_taps).pixels);
  }

  void runBlur(const Blur& blur, const cl::Buffer& images, int count, int subtract) {
    const int radius = static_cast<int>(blur.half_taps.size()) - 1;
    const LaunchRange range{cl::NDRange(padded(width_), padded(height_), static_cast<std::size_t>(count)),
                            cl::NDRange(kTile, kTile, 1)};
    launch(device_->openCl().solve_queue, &blur_rows_, range, images, weights_, blur.taps, radius, width_, height_,
           rows_);
    launch(device_->openCl().solve_queue, &blur_columns_, range, rows_, weights_, blur.norm, blur.taps, radius, width_,
           height_, subtract, filtered_);
  }

  /// filtered_ = weights · (smooth(images) − background(images)).
  void applyFilter(const cl::Buffer& images, int count) {
    if (smooth_.half_taps.empty()) {
      const std::size_t groups = (pixels() + kReduceGroup - 1) / kReduceGroup;
      launch(device_->openCl().solve_queue, &weigh_,
             {cl::NDRange(groups * kReduceGroup, static_cast<std::size_t>(count)), cl::NDRange(kReduceGroup, 1)},
             images, weights_, static_cast<int>(pixels()), filtered_);
    } else {
      runBlur(smooth_, images, count, 0);
    }
    if (!background_.half_taps.empty()) runBlur(background_, images, count, 1);
  }

  std::shared_ptr<Device> device_;
  cl::Program program_;
  cl::Kernel drr_;
  cl::Kernel blur_rows_;
  cl::Kernel blur_columns_;
  cl::Kernel weigh_;
  cl::Kernel moments_;
  cl::Buffer volume_;
  cl::Buffer images_;    // kPaperSlots images, as rendered.
  cl::Buffer filtered_;  // The same, filtered.
  cl::Buffer rows_;      // Between both passes of a blur.
  cl::Buffer target_;    // Filtered when there is a filter.
  cl::Buffer weights_;
  cl::Buffer partial_sums_;
  Blur smooth_;
  Blur background_;
  bool filter_ = false;
  VolumeGrid grid_;
  int row_ = 0;
  int slice_ = 0;
  int width_ = 0;
  int height_ = 0;
  std::size_t volume_bytes_ = 0;
};

}  // namespace

std::unique_ptr<PaperEngine> makePaperEngineOpenCl(std::shared_ptr<Device> device) {
  return std::make_unique<PaperEngineOpenCl>(std::move(device));
}

}  // namespace xray_registration

#include "xray_registration/drr/engine.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "xray_registration/drr/opencl/fast_program.h"
#include "xray_registration/drr/opencl/launch.h"
#include "xray_registration/drr/opencl/layout.h"
#include "xray_registration/drr/opencl/pose_parameters.h"

namespace xray_registration {
namespace {

using layout::kRays;
using layout::kTerms;
using layout::kTile;

constexpr int kSmallestSide = 32;    ///< Of the coarsest X-ray level, pixels.
constexpr double kMapVoxelMm = 5.0;  ///< Voxel size that is fine enough for that map.

/// The cut faces that the view sees from the side. What goes on behind a face that is seen from the front lies over the
/// whole image and changes slowly: it costs contrast, not edges, and to leave it out would leave nothing.
cl_int sideFaces(const ResidentLevel& level, const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  const Eigen::Vector3d middle = camera.rayDirection(0.5 * camera.width, 0.5 * camera.height).normalized();
  const Eigen::Vector3d along = T_camera_ct.linear().transpose() * middle;
  cl_int faces = level.cut_faces;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = level.index_from_ct.linear().row(axis).normalized();
    if (std::abs(normal.dot(along)) > 0.5) faces &= ~(3 << (2 * axis));
  }
  return faces;
}

LaunchRange perItem(int items) { return atLeast(static_cast<std::size_t>(items), kRays); }

int tilesFor(int pixels) { return (pixels + kTile - 1) / kTile; }

/// Of one image of floats.
std::size_t bytesOf(const XrayCamera& camera) {
  return sizeof(float) * static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

/// Standard deviation of the pixels with weight; above zero.
double deviationOf(const FloatImage& image, const FloatImage& weight) {
  double sum = 0.0;
  double sum2 = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const double w = weight.pixels[i] > 0.0F ? 1.0 : 0.0;
    sum += w * image.pixels[i];
    sum2 += w * image.pixels[i] * image.pixels[i];
    count += w;
  }
  return count > 0.0 ? std::sqrt(std::max(sum2 / count - sum * sum / (count * count), 1e-12)) : 1.0;
}

/// cl::Error → DeviceError with the step's name.
template <typename Work>
auto guarded(const Device& device, const char* what, Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const cl::Error& error) {
    throw DeviceError(std::string(what) + " failed on '" + device.name() + "': " + error.what() + ", code " +
                          std::to_string(error.err()),
                      error.err());
  }
}

StepSums stepSums(const double* terms) {
  StepSums sums;
  int pair = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      sums.matrix(i, j) = terms[layout::kTermMatrix + pair];
      sums.matrix(j, i) = terms[layout::kTermMatrix + pair];
      sums.scatter(i, j) = terms[layout::kTermScatter + pair];
      sums.scatter(j, i) = terms[layout::kTermScatter + pair];
      ++pair;
    }
  }
  for (int i = 0; i < 6; ++i) sums.gradient[i] = terms[layout::kTermGradient + i];
  sums.cost = terms[layout::kTermCost];
  sums.weight = terms[layout::kTermWeight];
  sums.content = terms[layout::kTermContent];
  if (sums.content > 0.0) {
    sums.similarity = terms[layout::kTermSimilarity] / sums.content;
    sums.inlier_fraction = terms[layout::kTermInliers] / sums.content;
  }
  return sums;
}

double eventMs(const cl::Event& event) {
  if (event() == nullptr) return 0.0;
  return 1e-6 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                    event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
}

}  // namespace

bool StepSums::finite() const { return matrix.allFinite() && gradient.allFinite() && std::isfinite(cost); }

Engine::Engine(std::shared_ptr<Device> device) : device_(std::move(device)) { kernels(1); }

Engine::Kernels& Engine::kernels(int split) {
  const auto found = kernels_.find(split);
  if (found != kernels_.end()) return found->second;
  return guarded(*device_, "compiling the kernels", [&]() -> Kernels& {
    Kernels k;
    const MarchShape shape{lanesFor(split), split};
    k.items_per_tile = shape.itemsPerTile();
    k.program = device_->build(fastSource(), fastOptions(shape));
    k.plan = cl::Kernel(k.program, "plan");
    k.render = cl::Kernel(k.program, "render");
    k.render_derivatives = cl::Kernel(k.program, "render_derivatives");
    for (const SimilarityKind& kind : kSimilarities) k.sums.emplace_back(k.program, kind.sums);
    k.windows = cl::Kernel(k.program, "windows");
    k.halve_xray = cl::Kernel(k.program, "halve_xray");
    k.used_tiles = cl::Kernel(k.program, "used_tiles");
    k.unexplained = cl::Kernel(k.program, "unexplained");
    k.apply_map = cl::Kernel(k.program, "apply_map");
    return kernels_.emplace(split, std::move(k)).first->second;
  });
}

int Engine::lanesFor(int split) const { return device_->isGpu() || split > 1 ? 1 : kRays; }

int Engine::chooseSplit(int groups) const {
  if (forced_split_ > 0) return forced_split_;
  // A GPU hides latency with many groups per compute unit; few rays leave it idle unless each is shared.
  if (device_->isGpu() && groups < 16 * device_->computeUnits()) return 4;
  return 1;
}

cl::Buffer& Engine::scratch(Scratch* scratch, std::size_t bytes) {
  if (scratch->bytes < bytes) {
    scratch->buffer = cl::Buffer(device_->context(), CL_MEM_READ_WRITE, bytes);
    scratch->bytes = bytes;
  }
  return scratch->buffer;
}

const ResidentLevel& Engine::level(int volume_level) const {
  return volume_->levels().at(static_cast<std::size_t>(volume_level));
}

void Engine::setVolume(const AttenuationVolume& volume) {
  volume_.reset();
  volume_ = std::make_unique<ResidentVolume>(device_.get(), volume);
}

ResidentXray::Level Engine::newXrayLevel(const XrayCamera& camera, const cl::Buffer& attenuation) {
  ResidentXray::Level level;
  level.camera = camera;
  level.tiles_x = tilesFor(camera.width);
  level.tiles_y = tilesFor(camera.height);
  level.attenuation = attenuation;
  level.weight = cl::Buffer(device_->context(), CL_MEM_READ_WRITE, bytesOf(camera));
  level.contrast =
      cl::Buffer(device_->context(), CL_MEM_READ_WRITE, sizeof(float) * static_cast<std::size_t>(level.tiles()));
  level.used_tiles =
      cl::Buffer(device_->context(), CL_MEM_READ_WRITE, sizeof(cl_int) * static_cast<std::size_t>(level.tiles()));
  return level;
}

void Engine::markUsedTiles(ResidentXray::Level* level) {
  launch(device_->solveQueue(), &kernels(1).used_tiles, perItem(level->tiles()), level->attenuation, level->weight,
         level->camera.width, level->camera.height, level->tiles_x, level->tiles(), level->used_tiles, level->contrast);
}

void Engine::keepContrastTiles(ResidentXray::Level* level, double part) {
  guarded(*device_, "choosing tiles", [&] {
    const auto count = static_cast<std::size_t>(level->tiles());
    std::vector<float> contrast(count);
    device_->solveQueue().enqueueReadBuffer(level->contrast, CL_TRUE, 0, sizeof(float) * count, contrast.data());
    std::vector<float> sorted = contrast;
    const auto threshold = sorted.begin() + static_cast<std::ptrdiff_t>((1.0 - part) * static_cast<double>(count - 1));
    std::nth_element(sorted.begin(), threshold, sorted.end());
    std::vector<cl_int> used(count);
    for (std::size_t i = 0; i < count; ++i) used[i] = contrast[i] > 0.0F && contrast[i] >= *threshold ? 1 : 0;
    device_->solveQueue().enqueueWriteBuffer(level->used_tiles, CL_TRUE, 0, sizeof(cl_int) * count, used.data());
  });
}

void Engine::halve(const ResidentXray::Level& fine, ResidentXray::Level* half) {
  const int width = half->camera.width;
  const int height = half->camera.height;
  launch(device_->solveQueue(), &kernels(1).halve_xray, perItem(width * height), fine.attenuation, fine.weight,
         fine.camera.width, fine.camera.height, width, height, half->attenuation, half->weight);
}

void Engine::halveAll(ResidentXray* xray) {
  for (std::size_t i = 0; i < xray->levels.size(); ++i) {
    if (i > 0) halve(xray->levels[i - 1], &xray->levels[i]);
    markUsedTiles(&xray->levels[i]);
  }
}

void Engine::restoreWeights(ResidentXray* xray) {
  guarded(*device_, "weighing the X-ray", [&] {
    const ResidentXray::Level& finest = xray->levels.front();
    device_->solveQueue().enqueueCopyBuffer(xray->mask, finest.weight, 0, 0, bytesOf(finest.camera));
    halveAll(xray);
  });
}

double Engine::weighUnexplained(ResidentXray* xray, const RigidTransform& T_camera_ct, double limit) {
  return guarded(*device_, "weighing the X-ray", [&]() -> double {
    cl::CommandQueue& queue = device_->solveQueue();
    const XrayCamera& camera = xray->levels.front().camera;
    const int level_index = volume_->levelFor(kMapVoxelMm);
    const ResidentLevel& ct = level(level_index);
    const cl_int cut_faces = sideFaces(ct, camera, T_camera_ct);
    if (cut_faces == 0) {
      restoreWeights(xray);
      return 1.0;
    }
    const int map_width = camera.width / layout::kMapStep + 2;
    const int map_height = camera.height / layout::kMapStep + 2;
    const float radius =
        0.6F * std::sqrt(static_cast<float>(ct.grid.size[0] * ct.grid.size[0] + ct.grid.size[1] * ct.grid.size[1] +
                                            ct.grid.size[2] * ct.grid.size[2]));
    uploadPoses(ct, camera, {T_camera_ct});
    const int points = map_width * map_height;
    launch(queue, &kernels(1).unexplained, perItem(points), ct.words, ct.grid, poses_.buffer, map_width, map_height,
           cut_faces, radius, static_cast<float>(limit),
           scratch(&map_, sizeof(float) * static_cast<std::size_t>(points)));
    launch(queue, &kernels(1).apply_map, perItem(camera.width * camera.height), xray->mask, map_.buffer, camera.width,
           camera.height, map_width, map_height, xray->levels.front().weight);
    halveAll(xray);
    std::vector<float> factors(static_cast<std::size_t>(points));
    queue.enqueueReadBuffer(map_.buffer, CL_TRUE, 0, sizeof(float) * factors.size(), factors.data());
    return std::accumulate(factors.begin(), factors.end(), 0.0) / static_cast<double>(factors.size());
  });
}

ResidentXray Engine::upload(const XrayCamera& camera, const FloatImage& attenuation, const FloatImage& weight) {
  return guarded(*device_, "uploading the X-ray", [&] {
    ResidentXray xray;
    xray.deviation = deviationOf(attenuation, weight);
    const std::size_t bytes = sizeof(float) * attenuation.pixels.size();
    const cl::Buffer pixels(device_->context(), CL_MEM_READ_WRITE, bytes);
    xray.mask = cl::Buffer(device_->context(), CL_MEM_READ_WRITE, bytes);
    cl::CommandQueue& queue = device_->solveQueue();
    queue.enqueueWriteBuffer(pixels, CL_FALSE, 0, bytes, attenuation.pixels.data());
    queue.enqueueWriteBuffer(xray.mask, CL_TRUE, 0, bytes, weight.pixels.data());
    xray.levels.push_back(newXrayLevel(camera, pixels));
    while (std::min(xray.levels.back().camera.width, xray.levels.back().camera.height) >= 2 * kSmallestSide) {
      const XrayCamera half = xray.levels.back().camera.binned(2);
      xray.levels.push_back(newXrayLevel(half, cl::Buffer(device_->context(), CL_MEM_READ_WRITE, bytesOf(half))));
    }
    restoreWeights(&xray);
    return xray;
  });
}

void Engine::uploadPoses(const ResidentLevel& level, const XrayCamera& camera,
                         const std::vector<RigidTransform>& poses) {
  pose_staging_.resize(poses.size() * layout::kPoseStride);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const PoseParameters parameters = poseParameters(level, camera, poses[i], poses[i] * volume_->centreCt());
    std::copy(parameters.begin(), parameters.end(),
              pose_staging_.begin() + static_cast<std::ptrdiff_t>(i * layout::kPoseStride));
  }
  device_->solveQueue().enqueueWriteBuffer(scratch(&poses_, sizeof(float) * pose_staging_.size()), CL_FALSE, 0,
                                           sizeof(float) * pose_staging_.size(), pose_staging_.data());
}

const cl::Buffer& Engine::allTiles(int tiles) {
  if (tiles > all_tiles_count_) {
    const std::vector<cl_int> ones(static_cast<std::size_t>(tiles), 1);
    device_->solveQueue().enqueueWriteBuffer(scratch(&all_tiles_, sizeof(cl_int) * ones.size()), CL_TRUE, 0,
                                             sizeof(cl_int) * ones.size(), ones.data());
    all_tiles_count_ = tiles;
  }
  return all_tiles_.buffer;
}

void Engine::planTiles(Kernels* k, const ResidentLevel& level, int tiles_x, int tiles, int poses,
                       const cl::Buffer& used_tiles) {
  const std::size_t groups = static_cast<std::size_t>(tiles) * static_cast<std::size_t>(poses);
  launch(device_->solveQueue(), &k->plan, groupsOf(k->items_per_tile, groups, &plan_event_), level.occupancy,
         level.grid, poses_.buffer, tiles_x, tiles, used_tiles, scratch(&plans_, groups * sizeof(cl_int4)));
}

std::vector<StepSums> Engine::evaluate(const ResidentXray::Level& xray, int volume_level,
                                       const std::vector<RigidTransform>& T_camera_ct, const WindowOptions& options) {
  return guarded(*device_, "a Gauss-Newton step", [&] {
    cl::CommandQueue& queue = device_->solveQueue();
    const ResidentLevel& ct = level(volume_level);
    const int poses = static_cast<int>(T_camera_ct.size());
    const int tiles = xray.tiles();
    const std::size_t groups = static_cast<std::size_t>(tiles) * static_cast<std::size_t>(poses);
    const int split = chooseSplit(static_cast<int>(groups));
    Kernels& k = kernels(split);

    uploadPoses(ct, xray.camera, T_camera_ct);
    planTiles(&kernels(1), ct, xray.tiles_x, tiles, poses, xray.used_tiles);
    launch(queue, &k.sums.at(static_cast<std::size_t>(options.similarity)),
           groupsOf(k.items_per_tile, groups, &march_event_), ct.words, ct.grid, poses_.buffer, plans_.buffer,
           xray.tiles_x, tiles, xray.camera.width, xray.camera.height, xray.attenuation, xray.weight,
           scratch(&sums_, groups * layout::kSumStride * sizeof(float)));

    // A window never has more tiles than the image; span 0 is one window of everything.
    const int span_x = options.span == 0 ? xray.tiles_x : std::min(options.span, xray.tiles_x);
    const int span_y = options.span == 0 ? xray.tiles_y : std::min(options.span, xray.tiles_y);
    const int windows_x = xray.tiles_x - span_x + 1;
    const int windows_y = xray.tiles_y - span_y + 1;
    const int window_groups = (windows_x * windows_y + kRays - 1) / kRays;
    last_windows_ = windows_x * windows_y;
    const std::size_t term_count = static_cast<std::size_t>(window_groups) * static_cast<std::size_t>(poses) * kTerms;
    const auto square = [](double value) { return static_cast<float>(value * value); };
    // A window with less than a quarter of its pixels has no reliable mean.
    const float min_weight = options.span == 0 ? 64.0F : 0.25F * static_cast<float>(span_x * span_y * kTile * kTile);
    const std::size_t correlation_bytes =
        sizeof(float) * static_cast<std::size_t>(last_windows_) * static_cast<std::size_t>(poses);
    launch(queue, &kernels(1).windows,
           groupsOf(kRays, static_cast<std::size_t>(window_groups) * static_cast<std::size_t>(poses), &windows_event_),
           sums_.buffer, xray.tiles_x, xray.tiles_y, span_x, span_y, windows_x, windows_y, window_groups,
           square(options.epsilon_value), square(options.epsilon_xray), static_cast<float>(options.robust_scale2),
           square(options.contrast), min_weight, scratch(&correlations_, correlation_bytes),
           scratch(&terms_, sizeof(float) * term_count));

    terms_staging_.resize(term_count);
    queue.enqueueReadBuffer(terms_.buffer, CL_TRUE, 0, sizeof(float) * term_count, terms_staging_.data());

    std::vector<StepSums> results;
    results.reserve(T_camera_ct.size());
    for (int pose = 0; pose < poses; ++pose) {
      double terms[kTerms] = {};
      for (int group = 0; group < window_groups; ++group) {
        const float* part = terms_staging_.data() + static_cast<std::ptrdiff_t>(pose * window_groups + group) * kTerms;
        for (int i = 0; i < kTerms; ++i) terms[i] += part[i];
      }
      results.push_back(stepSums(terms));
    }
    return results;
  });
}

std::vector<float> Engine::windowCorrelations() {
  return guarded(*device_, "reading the windows", [&] {
    std::vector<float> correlations(static_cast<std::size_t>(last_windows_));
    device_->solveQueue().enqueueReadBuffer(correlations_.buffer, CL_TRUE, 0, sizeof(float) * correlations.size(),
                                            correlations.data());
    return correlations;
  });
}

FloatImage Engine::render(const XrayCamera& camera, int volume_level, const RigidTransform& T_camera_ct) {
  return renderImages(&Kernels::render, 1, camera, volume_level, T_camera_ct).front();
}

std::vector<FloatImage> Engine::renderWithDerivatives(const XrayCamera& camera, int volume_level,
                                                      const RigidTransform& T_camera_ct) {
  return renderImages(&Kernels::render_derivatives, 7, camera, volume_level, T_camera_ct);
}

std::vector<FloatImage> Engine::renderImages(cl::Kernel Kernels::*kernel, std::size_t count, const XrayCamera& camera,
                                             int volume_level, const RigidTransform& T_camera_ct) {
  return guarded(*device_, "rendering a DRR", [&] {
    cl::CommandQueue& queue = device_->solveQueue();
    const ResidentLevel& ct = level(volume_level);
    const int tiles_x = tilesFor(camera.width);
    const int tiles = tiles_x * tilesFor(camera.height);
    Kernels& k = kernels(chooseSplit(tiles));
    const cl::Buffer& all_tiles = allTiles(tiles);
    uploadPoses(ct, camera, {T_camera_ct});
    planTiles(&kernels(1), ct, tiles_x, tiles, 1, all_tiles);
    std::vector<FloatImage> images(count, FloatImage(camera.width, camera.height));
    const std::size_t bytes = sizeof(float) * images.front().pixels.size();
    launch(queue, &(k.*kernel), groupsOf(k.items_per_tile, static_cast<std::size_t>(tiles), &march_event_), ct.words,
           ct.grid, poses_.buffer, plans_.buffer, tiles_x, tiles, camera.width, camera.height,
           scratch(&image_, count * bytes));
    for (std::size_t i = 0; i < count; ++i) {
      queue.enqueueReadBuffer(image_.buffer, CL_TRUE, i * bytes, bytes, images[i].pixels.data());
    }
    return images;
  });
}

Engine::KernelTimes Engine::lastKernelTimes() const {
  return {eventMs(plan_event_), eventMs(march_event_), eventMs(windows_event_)};
}

}  // namespace xray_registration

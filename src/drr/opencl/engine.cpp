#include "xray_registration/drr/engine.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "drr/opencl/guarded.h"
#include "drr/opencl/opencl_xray.h"
#include "drr/opencl/shift_matcher.h"
#include "drr/opencl/workbench.h"
#include "xray_registration/drr/opencl/opencl_volume.h"
#include "xray_registration/drr/opencl/pose_parameters.h"
#include "xray_registration/drr/tile_shape.h"

namespace xray_registration {
namespace {

using layout::kRays;
using layout::kTerms;

constexpr double kMapVoxelMm = 5.0;  ///< Voxel size that is fine enough for the map of unexplained tissue.

/// The cut faces that the view sees from the side. What goes on behind a face that is seen from the front lies over the
/// whole image and changes slowly: it costs contrast, not edges, and to leave it out would leave nothing.
cl_int sideFaces(const OpenClLevel& level, const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  const Eigen::Vector3d middle = camera.rayDirection(0.5 * camera.width, 0.5 * camera.height).normalized();
  const Eigen::Vector3d along = T_camera_ct.linear().transpose() * middle;
  cl_int faces = level.cut_faces;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = level.index_from_ct.linear().row(axis).normalized();
    if (std::abs(normal.dot(along)) > 0.5) faces &= ~(3 << (2 * axis));
  }
  return faces;
}

/// Covers the whole box, voxels.
float searchRadius(const DeviceGrid& grid) {
  const float x = static_cast<float>(grid.size[0]);
  const float y = static_cast<float>(grid.size[1]);
  const float z = static_cast<float>(grid.size[2]);
  return 0.6F * std::sqrt(x * x + y * y + z * z);
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

/// Adds up the groups' terms of each pose, in a fixed order and in double.
std::vector<StepSums> sumsOf(const std::vector<float>& terms, std::size_t poses) {
  const std::size_t floats_per_pose = terms.size() / poses;
  std::vector<StepSums> results;
  results.reserve(poses);
  for (std::size_t pose = 0; pose < poses; ++pose) {
    double total[kTerms] = {};
    for (std::size_t i = 0; i < floats_per_pose; ++i) total[i % kTerms] += terms[pose * floats_per_pose + i];
    results.push_back(stepSums(total));
  }
  return results;
}

double eventMs(const cl::Event& event) {
  if (event() == nullptr) return 0.0;
  return 1e-6 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                    event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
}

void pack(const RayMotion& motion, float* floats) {
  for (int i = 0; i < 3; ++i) {
    floats[layout::kMotionSource + i] = static_cast<float>(motion.source[i]);
    for (int j = 0; j < 3; ++j) {
      floats[layout::kMotionDirection + 3 * i + j] = static_cast<float>(motion.direction(i, j));
    }
  }
  floats[layout::kMotionRadial] = static_cast<float>(motion.radial);
  floats[layout::kMotionSwirl] = static_cast<float>(motion.swirl);
  floats[layout::kMotionOfCamera] = motion.of_camera ? 1.0F : 0.0F;
}

/// Work-groups of the windows' kernel.
int groupsOfWindows(const WindowGrid& grid) { return (grid.windows() + kRays - 1) / kRays; }

class EngineOpenCl : public Engine {
 public:
  explicit EngineOpenCl(std::shared_ptr<Device> device)
      : device_(std::move(device)),
        shared_bench_(std::make_shared<Workbench>(device_)),
        spare_xrays_(std::make_shared<SpareStorage>()) {}
  /// A sibling.
  EngineOpenCl(std::shared_ptr<Device> device, std::shared_ptr<Workbench> bench, std::shared_ptr<SpareStorage> spares)
      : device_(std::move(device)), shared_bench_(std::move(bench)), spare_xrays_(std::move(spares)) {}

  ~EngineOpenCl() override { bench_.settle(); }
  EngineOpenCl(const EngineOpenCl&) = delete;
  EngineOpenCl& operator=(const EngineOpenCl&) = delete;

  void setVolume(const AttenuationVolume& volume) override {
    volume_.reset();
    volume_ = std::make_unique<OpenClVolume>(*device_, volume);
  }
  bool hasVolume() const override { return volume_ != nullptr; }
  const ResidentVolume& volume() const override { return volume_->description(); }
  const OpenClVolume* openClVolume() const { return volume_.get(); }
  void releaseVolume() override { volume_.reset(); }

  std::unique_ptr<ResidentXray> upload(const XrayCamera& camera, const FloatImage& attenuation,
                                       const FloatImage& weight) override {
    return guarded(device_->name(), "uploading the X-ray",
                   [&] { return std::make_unique<OpenClXray>(camera, attenuation, weight, spare_xrays_, &bench_); });
  }

  std::unique_ptr<Engine> sibling() override {
    return std::make_unique<EngineOpenCl>(device_, shared_bench_, spare_xrays_);
  }

  std::unique_ptr<ResidentXray> share(ResidentXray* xray) override { return std::make_unique<OpenClXray>(own(xray)); }

  void surround(ResidentXray* xray, int xray_level, int volume_level, const RigidTransform& T_camera_ct) override {
    guarded(device_->name(), "drawing what surrounds a body", [&] {
      OpenClXray& seen = own(xray);
      seen.makeReady(xray_level, &bench_);
      const ResidentXray::Level& tiled = seen.level(xray_level);
      const cl::Buffer& image =
          draw(&FastKernels::render, 1, tiled.camera, volume_level, {T_camera_ct}, seen.usedTiles(xray_level));
      seen.surroundWith(image, xray_level, &bench_);
    });
  }

  void surroundAs(ResidentXray* xray, int xray_level, ResidentXray* other) override {
    guarded(device_->name(), "copying what surrounds a body", [&] {
      OpenClXray& seen = own(xray);
      seen.makeReady(xray_level, &bench_);
      seen.forgetSurroundings(xray_level);
      if (other->isSurrounded(xray_level)) seen.surroundWith(own(other).surroundings(xray_level), xray_level, &bench_);
    });
  }

  double weighUnexplained(ResidentXray* xray, const RigidTransform& T_camera_ct, double limit) override {
    return guarded(device_->name(), "weighing the X-ray", [&]() -> double {
      const XrayCamera& camera = xray->levels().front().camera;
      const OpenClLevel& ct = level(volume().levelFor(kMapVoxelMm));
      const cl_int cut_faces = sideFaces(ct, camera, T_camera_ct);
      if (cut_faces == 0) {
        own(xray).restoreWeights();
        return 1.0;
      }
      const int map_width = camera.width / layout::kMapStep + 2;
      const int map_height = camera.height / layout::kMapStep + 2;
      const int points = map_width * map_height;
      std::vector<float> factors(static_cast<std::size_t>(points));
      const std::size_t bytes = sizeof(float) * factors.size();
      uploadPoses(ct, camera, {T_camera_ct});
      FastKernels& k = bench_.kernels();
      bench_.run(&k.unexplained, k.perRay(points), ct.words, ct.grid, poses_.get(), map_width, map_height, cut_faces,
                 searchRadius(ct.grid), static_cast<float>(limit), map_.atLeast(bytes, &bench_));
      own(xray).weigh(map_.get(), map_width, map_height, &bench_);
      bench_.queue().enqueueReadBuffer(map_.get(), CL_TRUE, 0, bytes, factors.data());
      return std::accumulate(factors.begin(), factors.end(), 0.0) / static_cast<double>(factors.size());
    });
  }

  void restoreWeights(ResidentXray* xray) override { own(xray).restoreWeights(); }

  void keepContrastTiles(ResidentXray* xray, int xray_level, double part) override {
    guarded(device_->name(), "choosing tiles", [&] { own(xray).keepContrastTiles(xray_level, part, &bench_); });
  }

  void useAllTiles(ResidentXray* xray) override { own(xray).useAllTiles(); }

  std::vector<StepSums> evaluate(ResidentXray* xray, int xray_level, int volume_level,
                                 const std::vector<RigidTransform>& T_camera_ct,
                                 const WindowOptions& options) override {
    if (T_camera_ct.empty()) return {};
    return guarded(device_->name(), "a Gauss-Newton step", [&] {
      OpenClXray& seen = own(xray);
      seen.makeReady(xray_level, &bench_);
      addUpTiles(seen, xray_level, level(volume_level), T_camera_ct, options.similarity);
      return sumsOf(addUpWindows(seen.level(xray_level), T_camera_ct.size(), options), T_camera_ct.size());
    });
  }

  TileProducts addUpTiles(ResidentXray* xray, int xray_level, int volume_level, const XrayCamera& camera,
                          const Eigen::Affine3d& T_camera_ct, const std::vector<RayMotion>& motions) override {
    return guarded(device_->name(), "adding up tiles", [&] {
      OpenClXray& seen = own(xray);
      seen.makeReady(xray_level, &bench_);
      const ResidentXray::Level& tiled = seen.level(xray_level);
      TileProducts products;
      products.tiles_x = tiled.tiles_x;
      products.tiles_y = tiled.tiles_y;
      products.vectors = 3 + static_cast<int>(motions.size());
      products.sums.resize(static_cast<std::size_t>(tiled.tiles() * products.stride()));
      uploadPose(poseParameters(level(volume_level), camera, T_camera_ct.inverse(), Eigen::Vector3d::Zero()));
      uploadMotions(motions);
      runTileSums(&FastKernels::motion_sums, seen, xray_level, level(volume_level), &products.sums, motions_.get(),
                  static_cast<cl_int>(motions.size()));
      return products;
    });
  }

  TileProducts addUpBody(ResidentXray* xray, int xray_level, int volume_level,
                         const RigidTransform& T_camera_body) override {
    return guarded(device_->name(), "adding up a body's tiles", [&] {
      OpenClXray& seen = own(xray);
      seen.makeReady(xray_level, &bench_);
      const ResidentXray::Level& tiled = seen.level(xray_level);
      TileProducts products;
      products.tiles_x = tiled.tiles_x;
      products.tiles_y = tiled.tiles_y;
      products.vectors = layout::kVectors + 1;
      products.sums.resize(static_cast<std::size_t>(tiled.tiles() * products.stride()));
      uploadPoses(level(volume_level), tiled.camera, {T_camera_body});
      runTileSums(&FastKernels::body_sums, seen, xray_level, level(volume_level), &products.sums);
      return products;
    });
  }

  std::vector<float> windowCorrelations() override {
    return guarded(device_->name(), "reading the windows", [&] {
      std::vector<float> correlations(static_cast<std::size_t>(last_windows_));
      bench_.queue().enqueueReadBuffer(correlations_.get(), CL_TRUE, 0, sizeof(float) * correlations.size(),
                                       correlations.data());
      return correlations;
    });
  }

  FloatImage render(const XrayCamera& camera, int volume_level, const RigidTransform& T_camera_ct) override {
    return renderImages(&FastKernels::render, 1, camera, volume_level, T_camera_ct).front();
  }

  std::vector<float> matchShifts(const ShiftTarget& target, int volume_level,
                                 const std::vector<RigidTransform>& T_camera_ct) override {
    if (T_camera_ct.empty()) return {};
    return guarded(device_->name(), "comparing shifted DRRs", [&] {
      const XrayCamera camera = target.widened();
      const int tiles = layout::tilesFor(camera.width) * layout::tilesFor(camera.height);
      const cl::Buffer& drrs = draw(&FastKernels::render, 1, camera, volume_level, T_camera_ct, allTiles(tiles));
      return shift_matcher_.match(target, drrs, T_camera_ct.size(), &bench_);
    });
  }

  std::vector<FloatImage> renderWithDerivatives(const XrayCamera& camera, int volume_level,
                                                const RigidTransform& T_camera_ct) override {
    return renderImages(&FastKernels::render_derivatives, 7, camera, volume_level, T_camera_ct);
  }

  void forceSplit(int split) override { forced_split_ = split; }

  KernelTimes lastKernelTimes() const override {
    return {eventMs(plan_event_), eventMs(march_event_), eventMs(windows_event_)};
  }

  EngineWork work() const override { return bench_.work(); }
  const Device& device() const override { return *device_; }

 private:
  static OpenClXray& own(ResidentXray* xray) {
    auto* mine = dynamic_cast<OpenClXray*>(xray);
    if (mine == nullptr) throw std::invalid_argument("the X-ray is not on an OpenCL device");
    return *mine;
  }

  const OpenClLevel& level(int volume_level) const {
    return volume_->levels().at(static_cast<std::size_t>(volume_level));
  }

  int chooseSplit(std::size_t groups) const {
    if (forced_split_ > 0) return forced_split_;
    // A GPU hides latency with many groups per compute unit; few rays leave it idle unless each is shared.
    if (device_->isGpu() && groups < 16 * static_cast<std::size_t>(device_->computeUnits())) return 4;
    return 1;
  }

  void uploadPoses(const OpenClLevel& level, const XrayCamera& camera, const std::vector<RigidTransform>& poses) {
    std::vector<float>& floats = pose_staging_.refill();
    floats.resize(poses.size() * layout::kPoseStride);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const PoseParameters parameters = poseParameters(level, camera, poses[i], poses[i] * volume().centreCt());
      std::copy(parameters.begin(), parameters.end(),
                floats.begin() + static_cast<std::ptrdiff_t>(i * layout::kPoseStride));
    }
    pose_staging_.writeTo(&poses_, &bench_);
  }

  void uploadPose(const PoseParameters& parameters) {
    pose_staging_.refill().assign(parameters.begin(), parameters.end());
    pose_staging_.writeTo(&poses_, &bench_);
  }

  void uploadMotions(const std::vector<RayMotion>& motions) {
    if (motions.size() > layout::kMostMotions)
      throw std::invalid_argument("more motions of the rays than a launch takes");
    std::vector<float>& floats = motion_staging_.refill();
    floats.assign(std::max<std::size_t>(motions.size(), 1) * layout::kMotionStride, 0.0F);
    for (std::size_t i = 0; i < motions.size(); ++i) pack(motions[i], &floats[i * layout::kMotionStride]);
    motion_staging_.writeTo(&motions_, &bench_);
  }

  /// Runs such a kernel for one pose and reads the sums of all tiles.
  template <typename... More>
  void runTileSums(cl::Kernel FastKernels::*kernel, const OpenClXray& xray, int xray_level, const OpenClLevel& ct,
                   std::vector<float>* sums, const More&... more) {
    const ResidentXray::Level& seen = xray.level(xray_level);
    const auto groups = static_cast<std::size_t>(seen.tiles());
    FastKernels& k = bench_.kernels(chooseSplit(groups));
    planTiles(ct, seen.tiles_x, seen.tiles(), 1, xray.usedTiles(xray_level));
    const std::size_t bytes = sizeof(float) * sums->size();
    const cl::Buffer& out = sums_.atLeast(bytes, &bench_);
    bench_.run(&(k.*kernel), groupsOf(k.items_per_tile, groups, &march_event_), ct.words, ct.grid, poses_.get(),
               plans_.get(), seen.tiles_x, seen.tiles(), seen.camera.width, seen.camera.height,
               xray.attenuation(xray_level), xray.weight(xray_level), xray.surroundings(xray_level),
               xray.surrounded(xray_level), static_cast<float>(xray.saturation()), out, more...);
    bench_.queue().enqueueReadBuffer(out, CL_TRUE, 0, bytes, sums->data());
  }

  const cl::Buffer& allTiles(int tiles) {
    if (tiles > all_tiles_count_) {
      all_tiles_count_ = 0;
      const std::vector<cl_int> ones(static_cast<std::size_t>(tiles), 1);
      const std::size_t bytes = sizeof(cl_int) * ones.size();
      bench_.queue().enqueueWriteBuffer(all_tiles_.atLeast(bytes, &bench_), CL_TRUE, 0, bytes, ones.data());
      all_tiles_count_ = tiles;
    }
    return all_tiles_.get();
  }

  void planTiles(const OpenClLevel& level, int tiles_x, int tiles, std::size_t poses, const cl::Buffer& used_tiles) {
    const std::size_t groups = static_cast<std::size_t>(tiles) * poses;
    FastKernels& k = bench_.kernels();
    bench_.run(&k.plan, groupsOf(k.items_per_tile, groups, &plan_event_), level.occupancy, level.grid, poses_.get(),
               tiles_x, tiles, used_tiles, plans_.atLeast(groups * sizeof(cl_int4), &bench_));
  }

  /// The march: the sums of every tile of every pose.
  void addUpTiles(const OpenClXray& xray, int xray_level, const OpenClLevel& ct,
                  const std::vector<RigidTransform>& T_camera_ct, Similarity similarity) {
    const ResidentXray::Level& seen = xray.level(xray_level);
    const std::size_t groups = static_cast<std::size_t>(seen.tiles()) * T_camera_ct.size();
    FastKernels& k = bench_.kernels(chooseSplit(groups));
    uploadPoses(ct, seen.camera, T_camera_ct);
    planTiles(ct, seen.tiles_x, seen.tiles(), T_camera_ct.size(), xray.usedTiles(xray_level));
    bench_.run(&k.sums.at(static_cast<std::size_t>(similarity)), groupsOf(k.items_per_tile, groups, &march_event_),
               ct.words, ct.grid, poses_.get(), plans_.get(), seen.tiles_x, seen.tiles(), seen.camera.width,
               seen.camera.height, xray.attenuation(xray_level), xray.weight(xray_level), xray.surroundings(xray_level),
               xray.surrounded(xray_level), static_cast<float>(xray.saturation()),
               sums_.atLeast(groups * layout::kSumStride * sizeof(float), &bench_));
  }

  /// The terms of every group of windows of every pose.
  const std::vector<float>& addUpWindows(const ResidentXray::Level& xray, std::size_t poses,
                                         const WindowOptions& options) {
    const auto square = [](double value) { return static_cast<float>(value * value); };
    const WindowGrid grid(xray.tiles_x, xray.tiles_y, options.span);
    last_windows_ = grid.windows();
    const std::size_t groups = static_cast<std::size_t>(groupsOfWindows(grid)) * poses;
    terms_staging_.resize(groups * kTerms);
    const std::size_t bytes = sizeof(float) * terms_staging_.size();
    bench_.run(&bench_.kernels().windows, groupsOf(kRays, groups, &windows_event_), sums_.get(), xray.tiles_x,
               xray.tiles_y, grid.span_x, grid.span_y, grid.windows_x, grid.windows_y, groupsOfWindows(grid),
               square(options.epsilon_value), square(options.epsilon_xray), static_cast<float>(options.robust_scale2),
               square(options.contrast), grid.min_weight,
               correlations_.atLeast(sizeof(float) * static_cast<std::size_t>(grid.windows()) * poses, &bench_),
               terms_.atLeast(bytes, &bench_));
    bench_.queue().enqueueReadBuffer(terms_.get(), CL_TRUE, 0, bytes, terms_staging_.data());
    return terms_staging_;
  }

  /// Runs a kernel that writes whole images, one behind the other, and reads them back.
  std::vector<FloatImage> renderImages(cl::Kernel FastKernels::*kernel, std::size_t count, const XrayCamera& camera,
                                       int volume_level, const RigidTransform& T_camera_ct) {
    return guarded(device_->name(), "rendering a DRR", [&] {
      const int tiles = layout::tilesFor(camera.width) * layout::tilesFor(camera.height);
      const cl::Buffer& drawn = draw(kernel, count, camera, volume_level, {T_camera_ct}, allTiles(tiles));
      std::vector<FloatImage> images(count, FloatImage(camera.width, camera.height));
      const std::size_t bytes = sizeof(float) * images.front().pixels.size();
      for (std::size_t i = 0; i < count; ++i) {
        bench_.queue().enqueueReadBuffer(drawn, CL_TRUE, i * bytes, bytes, images[i].pixels.data());
      }
      return images;
    });
  }

  /// Runs such a kernel on the used tiles.
  const cl::Buffer& draw(cl::Kernel FastKernels::*kernel, std::size_t count, const XrayCamera& camera, int volume_level,
                         const std::vector<RigidTransform>& T_camera_ct, const cl::Buffer& used_tiles) {
    const OpenClLevel& ct = level(volume_level);
    const int tiles_x = layout::tilesFor(camera.width);
    const int tiles = tiles_x * layout::tilesFor(camera.height);
    const std::size_t groups = static_cast<std::size_t>(tiles) * T_camera_ct.size();
    FastKernels& k = bench_.kernels(chooseSplit(groups));
    uploadPoses(ct, camera, T_camera_ct);
    planTiles(ct, tiles_x, tiles, T_camera_ct.size(), used_tiles);
    const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(camera.width * camera.height);
    bench_.run(&(k.*kernel), groupsOf(k.items_per_tile, groups, &march_event_), ct.words, ct.grid, poses_.get(),
               plans_.get(), tiles_x, tiles, camera.width, camera.height,
               image_.atLeast(count * T_camera_ct.size() * bytes + sizeof(float) * kPixelsBehindShifts, &bench_));
    return image_.get();
  }

  std::shared_ptr<Device> device_;
  std::shared_ptr<Workbench> shared_bench_;  ///< With the siblings.
  Workbench& bench_ = *shared_bench_;
  std::unique_ptr<OpenClVolume> volume_;
  std::shared_ptr<SpareStorage> spare_xrays_;
  int forced_split_ = 0;
  GrowingBuffer poses_, plans_, sums_, correlations_, terms_, image_, all_tiles_, map_, motions_;
  int all_tiles_count_ = 0;
  ShiftMatcher shift_matcher_;
  Staging pose_staging_, motion_staging_;
  std::vector<float> terms_staging_;
  int last_windows_ = 0;
  cl::Event plan_event_, march_event_, windows_event_;
};

}  // namespace

std::unique_ptr<Engine> makeEngineOpenCl(std::shared_ptr<Device> device) {
  return std::make_unique<EngineOpenCl>(std::move(device));
}

const OpenClVolume& openClVolume(const Engine& engine) {
  const auto* opencl = dynamic_cast<const EngineOpenCl*>(&engine);
  if (opencl == nullptr || opencl->openClVolume() == nullptr) {
    throw std::invalid_argument("the engine holds no CT on an OpenCL device");
  }
  return *opencl->openClVolume();
}

}  // namespace xray_registration

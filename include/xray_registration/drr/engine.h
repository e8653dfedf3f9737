#pragma once

#include <map>
#include <memory>
#include <vector>

#include "xray_registration/drr/device.h"
#include "xray_registration/drr/resident_volume.h"
#include "xray_registration/drr/similarity.h"
#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// One X-ray on the device, full size (0) and halved again and again.
struct ResidentXray {
  struct Level {
    XrayCamera camera;
    cl::Buffer attenuation;
    cl::Buffer weight;      ///< 0 … 1 per pixel; 0 leaves it out.
    cl::Buffer used_tiles;  ///< Per tile, 0 leaves it out.
    cl::Buffer contrast;    ///< Per tile, variance of the X-ray.
    int tiles_x = 0;
    int tiles_y = 0;
    int tiles() const { return tiles_x * tiles_y; }
  };
  std::vector<Level> levels;
  cl::Buffer mask;         ///< Weights as uploaded, full size; the levels' weights may be lower (weighUnexplained).
  double deviation = 1.0;  ///< Standard deviation of the attenuation over the allowed pixels.
};

/// One evaluation of the objective E(ξ) = Σ windows importance · ρ(1 − correlation) at ξ = 0: value, exact gradient,
/// Gauss-Newton matrix. The twist is about the given centre, in the view's camera axes.
struct StepSums {
  Matrix6d matrix = Matrix6d::Zero();
  Twist gradient = Twist::Zero();
  Matrix6d scatter = Matrix6d::Zero();  ///< Σ of the windows' gradients' outer products.
  double cost = 0.0;
  double weight = 0.0;           ///< Σ importance: cost / weight is a mean in 0 … 2.
  double similarity = 0.0;       ///< Mean correlation over windows with CT content.
  double inlier_fraction = 0.0;  ///< Share of that content in windows that correlate well enough to show the CT.
  double content = 0.0;          ///< Pixels with CT content.
  bool finite() const;
};

/// The fast method's device side: Joseph's projector on packed voxels with the derivatives in the same march (P. M.
/// Joseph, 1982), sums per tile, normal equations per window. Everything is summed in a fixed order: the same input
/// gives the same bits on the same device. Not thread-safe. @throws DeviceError from every call.
class Engine {
 public:
  explicit Engine(std::shared_ptr<Device> device);

  void setVolume(const AttenuationVolume& volume);
  bool hasVolume() const { return volume_ != nullptr; }
  const ResidentVolume& volume() const { return *volume_; }
  void releaseVolume() { volume_.reset(); }

  /// Transfers an X-ray (weights 0 … 1 per pixel, the image's size) and halves it until a side is below 32 pixels.
  ResidentXray upload(const XrayCamera& camera, const FloatImage& attenuation, const FloatImage& weight);

  /// Lowers the weights where rays leave the CT through a cut face with tissue on it (the body goes on, the CT does
  /// not), smoothly, as seen from a pose; `limit` is the line integral of unexplained tissue that halves a weight.
  /// Returns the mean factor over the image: 1 when every ray is explained.
  double weighUnexplained(ResidentXray* xray, const RigidTransform& T_camera_ct, double limit);

  /// Back to the weights as uploaded.
  void restoreWeights(ResidentXray* xray);

  /// Uses only the `part` of a level's tiles in which the X-ray varies most: they carry nearly all information, and the
  /// march costs by the tile. Weighing anew brings all tiles back.
  void keepContrastTiles(ResidentXray::Level* level, double part);

  /// Objective and normal equations for many poses of one X-ray in one launch.
  std::vector<StepSums> evaluate(const ResidentXray::Level& xray, int volume_level,
                                 const std::vector<RigidTransform>& T_camera_ct, const WindowOptions& options);

  /// Correlation of each window (span² tiles, row by row) of the last evaluate's first pose; −2 where a window was left
  /// out.
  std::vector<float> windowCorrelations();

  /// Line integrals.
  FloatImage render(const XrayCamera& camera, int volume_level, const RigidTransform& T_camera_ct);

  /// The line integral image and its six derivatives by the twist about the CT's centre, for tests.
  std::vector<FloatImage> renderWithDerivatives(const XrayCamera& camera, int volume_level,
                                                const RigidTransform& T_camera_ct);

  /// Work-items that share one ray: 1, 2 or 4. Zero lets the engine choose by the device's size.
  void forceSplit(int split) { forced_split_ = split; }

  /// Device time of the kernels of the last evaluate or render, ms, by the events' own clock.
  struct KernelTimes {
    double plan_ms = 0.0;
    double march_ms = 0.0;
    double windows_ms = 0.0;
  };
  KernelTimes lastKernelTimes() const;

  Device& device() { return *device_; }

 private:
  struct Kernels {
    cl::Program program;
    std::size_t items_per_tile = 64;
    cl::Kernel plan, render, render_derivatives, windows, halve_xray, used_tiles, unexplained, apply_map;
    std::vector<cl::Kernel> sums;  ///< One for each similarity.
  };
  struct Scratch {
    cl::Buffer buffer;
    std::size_t bytes = 0;
  };

  Kernels& kernels(int split);
  int lanesFor(int split) const;
  int chooseSplit(int groups) const;
  cl::Buffer& scratch(Scratch* scratch, std::size_t bytes);
  const ResidentLevel& level(int volume_level) const;
  void uploadPoses(const ResidentLevel& level, const XrayCamera& camera, const std::vector<RigidTransform>& poses);
  void planTiles(Kernels* k, const ResidentLevel& level, int tiles_x, int tiles, int poses,
                 const cl::Buffer& used_tiles);
  const cl::Buffer& allTiles(int tiles);
  /// Runs a kernel that writes whole images, one behind the other, and reads them back.
  std::vector<FloatImage> renderImages(cl::Kernel Kernels::*kernel, std::size_t count, const XrayCamera& camera,
                                       int volume_level, const RigidTransform& T_camera_ct);
  ResidentXray::Level newXrayLevel(const XrayCamera& camera, const cl::Buffer& attenuation);
  void markUsedTiles(ResidentXray::Level* level);
  void halve(const ResidentXray::Level& fine, ResidentXray::Level* half);
  void halveAll(ResidentXray* xray);

  std::shared_ptr<Device> device_;
  std::unique_ptr<ResidentVolume> volume_;
  std::map<int, Kernels> kernels_;
  int forced_split_ = 0;
  Scratch poses_, plans_, sums_, correlations_, terms_, image_, all_tiles_, map_;
  int all_tiles_count_ = 0;
  std::vector<float> pose_staging_;
  std::vector<float> terms_staging_;
  int last_windows_ = 0;
  cl::Event plan_event_, march_event_, windows_event_;
};

}  // namespace xray_registration

#include "xray_registration/drr/reference_projector.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "xray_registration/common/parallel.h"

namespace xray_registration {
namespace {

/// A volume seen from a camera: the ray of a direction in the camera frame becomes a ray in "edge" coordinates, where
/// voxel i fills [i, i + 1].
class SiddonTracer {
 public:
  SiddonTracer(const AttenuationVolume& volume, const RigidTransform& T_camera_ct)
      : values_(volume.values.data()), scale_per_mm_(volume.scale_per_mm), size_(volume.grid.size) {
    const Eigen::Affine3d index_from_camera =
        volume.grid.ctFromIndex().inverse() * Eigen::Affine3d(T_camera_ct.inverse().matrix());
    origin_ = index_from_camera.translation() + Eigen::Vector3d::Constant(0.5);
    linear_ = index_from_camera.linear();
  }

  double integral(const Eigen::Vector3d& direction_camera) const {
    const Eigen::Vector3d direction = linear_ * direction_camera;
    Span span{0.0, std::numeric_limits<double>::infinity()};
    for (int axis = 0; axis < 3; ++axis) clip(axis, direction[axis], &span);
    if (!(span.enter < span.leave)) return 0.0;
    return march(direction, span) * direction_camera.norm() * scale_per_mm_;
  }

 private:
  /// Ray parameters, in units of the direction's length.
  struct Span {
    double enter;
    double leave;
  };

  void clip(int axis, double direction, Span* span) const {
    if (direction == 0.0) {
      if (origin_[axis] < 0.0 || origin_[axis] >= size_[axis]) span->leave = span->enter;
      return;
    }
    const double at_low = -origin_[axis] / direction;
    const double at_high = (size_[axis] - origin_[axis]) / direction;
    span->enter = std::max(span->enter, std::min(at_low, at_high));
    span->leave = std::min(span->leave, std::max(at_low, at_high));
  }

  /// Sum of value times parameter length over the voxels between both ends of the span.
  double march(const Eigen::Vector3d& direction, const Span& span) const {
    int index[3];
    int step[3];
    double next[3];  // Parameter at which the ray leaves the voxel along each axis.
    for (int axis = 0; axis < 3; ++axis) {
      const double entry = origin_[axis] + span.enter * direction[axis];
      index[axis] = std::clamp(static_cast<int>(std::floor(entry)), 0, size_[axis] - 1);
      step[axis] = direction[axis] > 0.0 ? 1 : -1;
      next[axis] = leavesVoxelAt(axis, index[axis], direction[axis]);
    }
    const std::ptrdiff_t row = size_.x();
    const std::ptrdiff_t slice = row * size_.y();
    double sum = 0.0;
    double at = span.enter;
    while (at < span.leave) {
      int axis = next[0] < next[1] ? 0 : 1;
      if (next[2] < next[axis]) axis = 2;
      const double until = std::min(next[axis], span.leave);
      // Rounding may put the entry a hair beyond a plane: that step has no length.
      if (until > at) {
        sum += (until - at) * values_[index[0] + row * index[1] + slice * index[2]];
        at = until;
      }
      index[axis] += step[axis];
      if (index[axis] < 0 || index[axis] >= size_[axis]) break;
      // From the plane itself, not by adding up: no drift over long rays.
      next[axis] = leavesVoxelAt(axis, index[axis], direction[axis]);
    }
    return sum;
  }

  double leavesVoxelAt(int axis, int index, double direction) const {
    if (direction == 0.0) return std::numeric_limits<double>::infinity();
    return (index + (direction > 0.0 ? 1 : 0) - origin_[axis]) / direction;
  }

  const std::uint16_t* values_;
  double scale_per_mm_;
  Eigen::Vector3i size_;
  Eigen::Vector3d origin_;
  Eigen::Matrix3d linear_;
};

void check(const AttenuationVolume& volume, const XrayCamera& camera, int samples_per_pixel_axis) {
  const std::string problem = camera.problem();
  if (!problem.empty()) throw std::invalid_argument("reference projection: " + problem);
  if (samples_per_pixel_axis < 1) {
    throw std::invalid_argument("reference projection: samples_per_pixel_axis is " +
                                std::to_string(samples_per_pixel_axis) + ", it must be at least 1");
  }
  if (volume.values.size() != volume.grid.voxelCount()) {
    throw std::invalid_argument("reference projection: the volume has " + std::to_string(volume.values.size()) +
                                " values for " + std::to_string(volume.grid.voxelCount()) + " voxels");
  }
}

double pixelMean(const SiddonTracer& tracer, const XrayCamera& camera, int u, int v, int samples) {
  double sum = 0.0;
  for (int j = 0; j < samples; ++j) {
    for (int i = 0; i < samples; ++i) {
      const double du = (i + 0.5) / samples - 0.5;
      const double dv = (j + 0.5) / samples - 0.5;
      sum += tracer.integral(camera.rayDirection(u + du, v + dv));
    }
  }
  return sum / (static_cast<double>(samples) * samples);
}

}  // namespace

double referenceLineIntegral(const AttenuationVolume& volume, const RigidTransform& T_camera_ct,
                             const XrayCamera& camera, double u, double v) {
  if (volume.values.empty()) return 0.0;
  return SiddonTracer(volume, T_camera_ct).integral(camera.rayDirection(u, v));
}

FloatImage referenceProjection(const AttenuationVolume& volume, const RigidTransform& T_camera_ct,
                               const XrayCamera& camera, int samples_per_pixel_axis) {
  check(volume, camera, samples_per_pixel_axis);
  FloatImage image(camera.width, camera.height, 0.0F);
  if (volume.values.empty()) return image;

  const SiddonTracer tracer(volume, T_camera_ct);
  std::atomic<int> next_row{0};
  const auto work = [&] {
    for (int v = next_row++; v < image.height; v = next_row++) {
      for (int u = 0; u < image.width; ++u) {
        image.at(u, v) = static_cast<float>(pixelMean(tracer, camera, u, v, samples_per_pixel_axis));
      }
    }
  };
  // One call for each thread; each takes rows as it gets to them, since they cost differently.
  parallelFor(image.height, [&work](int, int) { work(); });
  return image;
}

}  // namespace xray_registration

#include "tools/benchmark/scenes.h"

#include <algorithm>
#include <cmath>

#include "xray_registration/registration/paper/paper_method.h"
#include "xray_registration/volume/phantom.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration::tools {

AttenuationVolume cutTo(const AttenuationVolume& volume, const Eigen::Vector3i& size) {
  AttenuationVolume cut;
  cut.grid = volume.grid;
  cut.grid.size = size;
  cut.scale_per_mm = volume.scale_per_mm;
  const Eigen::Vector3i first = (volume.grid.size - size) / 2;
  cut.grid.origin_ct_mm = volume.grid.ctFromIndex() * first.cast<double>();
  cut.values.assign(cut.grid.voxelCount(), 0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<std::size_t>(2 * axis);
    const bool shortened = size[axis] < volume.grid.size[axis];
    cut.face_is_cut[low] = shortened || (size[axis] == volume.grid.size[axis] && volume.face_is_cut[low]);
    cut.face_is_cut[low + 1] = shortened || (size[axis] == volume.grid.size[axis] && volume.face_is_cut[low + 1]);
  }
  const Eigen::Vector3i from = first.cwiseMax(0);
  const Eigen::Vector3i to = (first + size).cwiseMin(volume.grid.size);
  for (int z = from.z(); z < to.z(); ++z) {
    for (int y = from.y(); y < to.y(); ++y) {
      const auto source = (static_cast<std::size_t>(z) * volume.grid.size.y() + y) * volume.grid.size.x() + from.x();
      const auto target = (static_cast<std::size_t>(z - first.z()) * size.y() + (y - first.y())) * size.x() +
                          static_cast<std::size_t>(from.x() - first.x());
      std::copy_n(volume.values.begin() + static_cast<std::ptrdiff_t>(source), to.x() - from.x(),
                  cut.values.begin() + static_cast<std::ptrdiff_t>(target));
    }
  }
  return cut;
}

AttenuationVolume headScene(int n) {
  return cutTo(toAttenuation(headPhantom(245.0 / n), {}), Eigen::Vector3i::Constant(n));
}

AttenuationVolume doubled(const AttenuationVolume& volume) {
  AttenuationVolume fine;
  fine.grid = volume.grid;
  fine.grid.size *= 2;
  fine.grid.spacing_mm *= 0.5;
  fine.grid.origin_ct_mm = volume.grid.ctFromIndex() * Eigen::Vector3d::Constant(-0.25);
  fine.scale_per_mm = volume.scale_per_mm;
  fine.face_is_cut = volume.face_is_cut;
  fine.values.resize(fine.grid.voxelCount());
  const Eigen::Vector3i n = fine.grid.size;
  auto out = fine.values.begin();
  for (int z = 0; z < n.z(); ++z) {
    for (int y = 0; y < n.y(); ++y) {
      const std::size_t row = (static_cast<std::size_t>(z / 2) * volume.grid.size.y() + y / 2) * volume.grid.size.x();
      for (int x = 0; x < n.x(); ++x) *out++ = volume.values[row + static_cast<std::size_t>(x / 2)];
    }
  }
  return fine;
}

AttenuationVolume tableTwoVolume(const AttenuationVolume& ct) {
  const int across = std::max(ct.grid.size.x(), ct.grid.size.y());
  const int factor = std::max(1, static_cast<int>(std::lround(across / 128.0)));
  const double spacing_mm = ct.grid.spacing_mm.x() * factor;
  // The paper's slices are thicker than its pixels: never finer than that here.
  const int slices = std::max(1, static_cast<int>(spacing_mm / ct.grid.spacing_mm.z()));
  return cutTo(downsampled(ct, {factor, factor, slices}), {128, 128, 100});
}

AttenuationVolume tableTwoPhantom() { return cutTo(toAttenuation(headPhantom(1.9), {}), {128, 128, 100}); }

PaperGeometry benchmarkGeometry(const VolumeGrid& grid, int image_size) {
  return paperGeometry(grid, image_size, 2.0 * grid.size.x() * grid.spacing_mm.x());
}

FastScene fastScene(const VolumeGrid& grid, int image_size, char axis) {
  const PaperGeometry geometry = benchmarkGeometry(grid, image_size);
  PaperProblem problem;
  problem.camera = geometry.camera;
  problem.centre_ct_mm = grid.centreCt();
  problem.T_camera_ct_start = geometry.T_camera_ct;
  if (axis != 'z') {
    const Eigen::Vector3d about = axis == 'x' ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
    const Eigen::Translation3d to_centre(problem.centre_ct_mm);
    problem.T_camera_ct_start =
        problem.T_camera_ct_start * to_centre * Eigen::AngleAxisd(EIGEN_PI / 2.0, about) * to_centre.inverse();
  }
  FastScene scene;
  scene.camera = problem.camera;
  scene.T_camera_ct = problem.T_camera_ct_start;
  scene.T_camera_ct_true = paperPose(problem, PaperParameters::Constant(2.0));
  return scene;
}

}  // namespace xray_registration::tools

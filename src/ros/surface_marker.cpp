#include "xray_registration/ros/surface_marker.h"

#include <algorithm>

namespace xray_registration {

namespace {

std::int16_t blockMean(const Volume& ct, const Eigen::Vector3i& first, int factor) {
  long sum = 0;
  for (int z = 0; z < factor; ++z) {
    for (int y = 0; y < factor; ++y) {
      const std::size_t row =
          (static_cast<std::size_t>(first.z() + z) * ct.grid.size.y() + first.y() + y) * ct.grid.size.x() + first.x();
      for (int x = 0; x < factor; ++x) sum += ct.hu[row + x];
    }
  }
  return static_cast<std::int16_t>(sum / (factor * factor * factor));
}

}  // namespace

Volume reducedForDisplay(const Volume& ct, std::size_t max_voxels) {
  int factor = 1;
  const auto voxels = [&](int f) {
    const Eigen::Vector3i size = ct.grid.size / f;
    return static_cast<std::size_t>(size.x()) * size.y() * size.z();
  };
  while (voxels(factor) > max_voxels && ct.grid.size.minCoeff() >= 2 * (factor + 1)) ++factor;
  if (factor == 1) return ct;
  Volume reduced;
  reduced.name = ct.name;
  reduced.grid = ct.grid;
  reduced.grid.size = ct.grid.size / factor;
  reduced.grid.spacing_mm = ct.grid.spacing_mm * factor;
  // The first voxel's centre is the centre of its block.
  const double shift = 0.5 * (factor - 1);
  reduced.grid.origin_ct_mm = ct.grid.ctFromIndex() * Eigen::Vector3d(shift, shift, shift);
  reduced.hu.reserve(reduced.grid.voxelCount());
  for (int z = 0; z < reduced.grid.size.z(); ++z) {
    for (int y = 0; y < reduced.grid.size.y(); ++y) {
      for (int x = 0; x < reduced.grid.size.x(); ++x) {
        reduced.hu.push_back(blockMean(ct, factor * Eigen::Vector3i(x, y, z), factor));
      }
    }
  }
  return reduced;
}

visualization_msgs::Marker toMarker(const TriangleMesh& mesh, const std::string& frame_id) {
  visualization_msgs::Marker marker;
  marker.header.frame_id = frame_id;
  marker.ns = "ct_surface";
  marker.type = visualization_msgs::Marker::TRIANGLE_LIST;
  marker.action = mesh.triangles.empty() ? visualization_msgs::Marker::DELETE : visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
  marker.color.r = 0.93F;
  marker.color.g = 0.89F;
  marker.color.b = 0.78F;
  marker.color.a = 1.0F;
  marker.frame_locked = 1;  // The bones follow the newest transform.
  marker.points.reserve(mesh.triangles.size() * 3);
  for (const auto& triangle : mesh.triangles) {
    for (const int corner : triangle) {
      const Eigen::Vector3f& vertex = mesh.vertices_ct_mm[static_cast<std::size_t>(corner)];
      geometry_msgs::Point point;
      point.x = vertex.x() * 1e-3;
      point.y = vertex.y() * 1e-3;
      point.z = vertex.z() * 1e-3;
      marker.points.push_back(point);
    }
  }
  return marker;
}

}  // namespace xray_registration

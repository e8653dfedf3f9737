#pragma once

#include <array>
#include <vector>

#include "xray_registration/volume/attenuation.h"
#include "xray_registration/volume/volume.h"

namespace xray_registration {

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices_ct_mm;
  std::vector<std::array<int, 3>> triangles;
};

/// Surface of what is above `threshold_hu`, marching cubes by ITK, decimated to at most `max_triangles`.
TriangleMesh boneSurface(const Volume& ct, double threshold_hu, std::size_t max_triangles);

/// The same of what attenuates more than `level_per_mm`.
TriangleMesh isoSurface(const AttenuationVolume& volume, double level_per_mm, std::size_t max_triangles);

}  // namespace xray_registration

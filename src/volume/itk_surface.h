#pragma once

#include <array>
#include <cstdint>
#include <vector>

// Marching cubes by ITK in plain types; see itk_image_file.h for why.

namespace xray_registration {

struct IndexMesh {
  std::vector<std::array<float, 3>> vertices;  ///< In voxel indices, half-way between a voxel inside and one outside.
  std::vector<std::array<int, 3>> triangles;
};

/// Surface between the non-zero and the zero voxels (x fastest). The outermost voxels must be zero.
IndexMesh surfaceOfMask(const std::array<int, 3>& size, const std::vector<std::uint8_t>& mask);

}  // namespace xray_registration

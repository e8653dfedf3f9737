#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// Triangles in the frame of the file that they come from, mm.
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> points_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Reads STL (ASCII, binary), PLY (ASCII, binary of either endianness) and legacy VTK polydata (ASCII, binary, versions
/// up to 5.1); which of them it is says the content, not the name. Polygons become fans of triangles. STL's points,
/// which it repeats for every triangle, are merged where they are equal. When `directory` is not empty, the file must
/// lie below it after resolving links.
/// @throws VolumeError naming the file when it is none of these, is damaged, has no triangles, or numbers that are not
/// finite.
SurfaceMesh readMesh(const std::string& path, const std::string& directory = "");

/// The solid that a closed mesh bounds, as a volume in the mesh's frame (axes parallel to its own) with a layer of air
/// around it. A border voxel gets the share of it that is solid: exactly along x, on 4 × 4 lines per voxel in y and z.
///
/// Duplicate and degenerate triangles, equal points, and normals that point anywhere do no harm, nor do shells that
/// overlap. A shell whose normals point the other way than those of the shell around it is a cavity.
/// @param attenuation_per_mm  of the solid, 1/mm.
/// @param spacing_mm  edge of a voxel; 0: from the size and the thickness (0.5 mm for a knee implant), at most 40 M
/// voxels.
/// @param name  of the mesh in messages: its file.
/// @throws VolumeError naming the mesh when it has no triangles, is not closed (how many edges lack a neighbour, and
/// where), is shorter than 2 mm or longer than 1 m (a file in metres), and for an attenuation or spacing that makes no
/// sense.
AttenuationVolume voxelise(const SurfaceMesh& mesh, double attenuation_per_mm, double spacing_mm = 0.0,
                           const std::string& name = "mesh");

}  // namespace xray_registration

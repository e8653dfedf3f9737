#pragma once

#include <string>

#include "xray_registration/volume/surface_mesh.h"

namespace xray_registration {

// One reader per format, each of a whole file's bytes. They throw VolumeError naming `path`.

SurfaceMesh readStl(const std::string& bytes, const std::string& path);
SurfaceMesh readPly(const std::string& bytes, const std::string& path);
SurfaceMesh readVtk(const std::string& bytes, const std::string& path);

/// @throws VolumeError: the path in quotes, then what is wrong.
[[noreturn]] void refuseMesh(const std::string& path, const std::string& what);

/// A polygon becomes a fan of triangles around its first point; fewer than three points are none.
void addPolygon(const std::vector<std::uint32_t>& corners, SurfaceMesh* mesh);

}  // namespace xray_registration

#pragma once

#include <string>

#include "xray_registration/volume/surface_mesh.h"

namespace xray_registration {

/// The mesh with each point once; triangles that lose a corner by that are gone.
SurfaceMesh withMergedPoints(const SurfaceMesh& mesh);

/// A surface that bounds a solid.
struct ClosedSurface {
  SurfaceMesh mesh;
  /// Triangles that share an edge run along it in opposite directions, so that the winding number tells inside from
  /// outside also where shells overlap. Else only the parity of crossings does.
  bool is_oriented = false;
};

/// Merges points, drops duplicate triangles, and turns the triangles of a shell alike. A shell whose triangles agree
/// keeps its side; else its normals point outwards.
/// @throws VolumeError naming the mesh when an edge belongs to an odd number of triangles.
ClosedSurface closedSurface(const SurfaceMesh& mesh, const std::string& name);

/// Signed volume inside a mesh, mm³: positive when normals (right hand rule) point outwards.
double signedVolume(const SurfaceMesh& mesh);

}  // namespace xray_registration

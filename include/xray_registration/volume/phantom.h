#pragma once

#include <vector>

#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// An ellipsoid of constant HU in the CT frame; later ones in a list replace earlier ones.
struct PhantomEllipsoid {
  Eigen::Vector3d centre_ct_mm;
  Eigen::Vector3d semi_axes_mm;
  Eigen::Matrix3d rotation;  ///< Columns: the semi-axes' directions in the CT frame.
  double hu;
};

/// The paper's white cube: n³ voxels of HU 0 (water) inside a border of air as the paper's experiment has it, spacing
/// so that the cube has unit side times `side_mm` at every n.
Volume whiteCube(int n, double side_mm = 100.0);

/// A head: skin, skull of uneven thickness, orbits, sinuses, teeth, petrous bones, one marker; no symmetry that would
/// make the pose ambiguous. About 180×220×230 mm, spacing_mm isotropic.
Volume headPhantom(double spacing_mm);

/// A pelvis cut at both ends (z), femora, sacrum, gas; about 360×240×260 mm.
Volume pelvisPhantom(double spacing_mm);

/// Paints ellipsoids into a grid with `supersampling`³ samples per voxel.
Volume paintPhantom(const VolumeGrid& grid, const std::vector<PhantomEllipsoid>& shapes, int supersampling = 2);

}  // namespace xray_registration

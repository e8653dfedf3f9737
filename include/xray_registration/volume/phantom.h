#pragma once

#include <map>
#include <string>
#include <vector>

#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// An ellipsoid of constant HU in the CT frame; later ones in a list replace earlier ones.
struct PhantomEllipsoid {
  Eigen::Vector3d centre_ct_mm;
  Eigen::Vector3d semi_axes_mm;
  Eigen::Matrix3d rotation;  ///< Columns: the semi-axes' directions in the CT frame.
  double hu;
  int label = 0;  ///< Of the bone that it belongs to; 0 is none.
};

/// A phantom with its bones apart.
struct LabelledPhantom {
  Volume ct;
  LabelVolume labels;  ///< On the CT's grid; bone voxels alone, as a segmentation has them.
  std::map<std::string, int> names;
  /// The point that a bone turns about, CT frame in mm, for those with a joint.
  std::map<std::string, Eigen::Vector3d> joints_ct_mm;
};

/// The paper's white cube. The volume has n³ voxels and is side_mm long in each axis at every n, centred in the CT
/// frame's origin: the paper's [0, 1]³, times side_mm. The middle half of each axis is white (HU 0, water) and the rest
/// air, so that the turned and shifted cube keeps its edges in the volume; the paper leaves this open. Voxels on the
/// cube's border are partly filled when n is no multiple of four.
/// @throws std::invalid_argument for n outside 4…1024.
Volume whiteCube(int n, double side_mm = 100.0);

/// A head: skin, skull of uneven thickness, orbits, sinuses, teeth, petrous bones, one marker; no symmetry that would
/// make the pose ambiguous. About 180×220×230 mm, closed on all sides, spacing_mm isotropic; centred away from the CT
/// frame's origin, as real CTs are.
/// @throws std::invalid_argument for a spacing outside 0.2…20 mm.
Volume headPhantom(double spacing_mm);

/// A pelvis cut at both ends (z), femora, sacrum, gas; about 360×240×260 mm, centred away from the CT frame's origin.
/// @throws std::invalid_argument for a spacing outside 0.2…20 mm.
Volume pelvisPhantom(double spacing_mm);

/// The same with labels: skull, mandible, C2 … C5.
LabelledPhantom labelledHeadPhantom(double spacing_mm);

/// The same with labels: femur_left, femur_right, hip_left, hip_right, sacrum, L5, L4.
LabelledPhantom labelledPelvisPhantom(double spacing_mm);

/// Paints ellipsoids into a grid of air with `supersampling`³ samples per voxel, over all host threads.
/// @throws std::invalid_argument for an empty grid or a semi-axis that is not positive.
Volume paintPhantom(const VolumeGrid& grid, const std::vector<PhantomEllipsoid>& shapes, int supersampling = 2);

/// The labels of the ellipsoids at the voxels' centres, where what was painted is denser than soft tissue.
/// @throws std::invalid_argument as paintPhantom does.
LabelVolume paintLabels(const Volume& painted, const std::vector<PhantomEllipsoid>& shapes);

}  // namespace xray_registration

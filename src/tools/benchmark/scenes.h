#pragma once

#include "xray_registration/drr/paper/paper_rays.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration::tools {

/// The middle `size` voxels; where the volume is smaller, air is added.
AttenuationVolume cutTo(const AttenuationVolume& volume, const Eigen::Vector3i& size);

/// The head phantom in n³ voxels, 245 mm a side at every n.
AttenuationVolume headScene(int n);

/// The same with every voxel split into eight: 2 n³ voxels in the same place, for sizes that take long to paint.
AttenuationVolume doubled(const AttenuationVolume& volume);

/// A CT as the paper's second experiment had one: averaged to about 128 voxels across, cut to 128×128×100.
AttenuationVolume tableTwoVolume(const AttenuationVolume& ct);
/// The same from the head phantom.
AttenuationVolume tableTwoPhantom();

/// The paper's arrangement with an image of `image_size`² on a plane twice as wide as the volume: the nearest voxels
/// are magnified almost twice, so all of it stays in view.
PaperGeometry benchmarkGeometry(const VolumeGrid& grid, int image_size);

/// Where a solver may stand: the paper's arrangement, 2° and 2 mm from the truth about every axis.
struct FastScene {
  XrayCamera camera;
  RigidTransform T_camera_ct = RigidTransform::Identity();
  RigidTransform T_camera_ct_true = RigidTransform::Identity();
};

/// `axis`: 'x', 'y' or 'z', the volume's axis that the rays run along.
FastScene fastScene(const VolumeGrid& grid, int image_size, char axis = 'z');

}  // namespace xray_registration::tools

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// HU → linear attenuation: µ = water_per_mm (1 + HU / 1000), and 0 (air) below threshold_hu.
struct AttenuationModel {
  double water_per_mm = 0.02;
  double threshold_hu = -800.0;
};

/// Linear attenuation in 16 bits: µ = value · scale_per_mm, in 1/mm; 0 is air. x fastest.
struct AttenuationVolume {
  VolumeGrid grid;
  std::vector<std::uint16_t> values;
  float scale_per_mm = 0.0F;
  /// Whether the body goes on beyond the face: {x low, x high, y low, y high, z low, z high} in index axes. A face is
  /// cut when tissue lies on it; rays that leave through such a face are not explained by the CT.
  std::array<bool, 6> face_is_cut{};
};

/// Converts a CT. With labels, all voxels whose label (nearest neighbour, through the CT frame) is not `label` count as
/// air and no face is cut by them.
/// @throws VolumeError naming the parameter when the model is out of range or the label selects no voxel.
AttenuationVolume toAttenuation(const Volume& ct, const AttenuationModel& model);
AttenuationVolume toAttenuation(const Volume& ct, const AttenuationModel& model, const LabelVolume& labels, int label);
/// The same with all voxels that have one of several labels.
AttenuationVolume toAttenuation(const Volume& ct, const AttenuationModel& model, const LabelVolume& labels,
                                const std::vector<int>& chosen);

/// Centre of the non-air voxels' bounding box in CT coordinates, mm: the point that the solver turns about.
Eigen::Vector3d anatomicalCentreCt(const AttenuationVolume& attenuation);

}  // namespace xray_registration

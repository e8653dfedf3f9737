#pragma once

#include <bitset>
#include <cstdint>
#include <vector>

#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// Which body a label belongs to.
class LabelTable {
 public:
  /// @throws VolumeError when a label is outside 1…65535 or stands twice, a body has none, or there are too many
  /// bodies.
  explicit LabelTable(const std::vector<std::vector<int>>& labels_of_bodies);

  /// What BodyMap stores for a label.
  std::uint8_t codeOf(int label) const { return codes_[static_cast<std::size_t>(label)]; }

 private:
  std::vector<std::uint8_t> codes_;
};

/// Voxel indices, both ends inside.
struct IndexBox {
  Eigen::Vector3i low;
  Eigen::Vector3i high;
};

/// Which body each voxel of a CT belongs to.
class BodyMap {
 public:
  BodyMap(const VolumeGrid& grid, const LabelVolume& labels, const LabelTable& table);

  /// Whether any voxel has this label.
  bool met(int label) const { return met_[static_cast<std::size_t>(label)]; }

  /// Lets every body grow by up to `steps` voxels into unlabelled voxels as dense as bone that touch nothing else.
  void growInto(const Volume& ct, int steps);

  /// The body's number, -1 for background, -2 for other labels.
  int at(std::size_t voxel) const;

  std::size_t index(int x, int y, int z) const { return (static_cast<std::size_t>(z) * size_.y() + y) * size_.x() + x; }

  /// Box of a body that has voxels.
  IndexBox boxOf(int body) const;

 private:
  std::uint8_t grownCode(const Volume& ct, const Eigen::Vector3i& at) const;
  void extend(std::uint8_t code, const Eigen::Vector3i& at);

  Eigen::Vector3i size_;
  std::vector<std::uint8_t> codes_;
  std::vector<IndexBox> boxes_;
  std::bitset<65536> met_;
};

/// How many voxels of the CT a voxel of the labels is long, at least 1 and at most 4.
int growthReach(const VolumeGrid& ct, const VolumeGrid& labels);

}  // namespace xray_registration

#include "body_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "label_sampling.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

constexpr std::uint8_t kBackground = 0;
constexpr std::uint8_t kOtherLabel = 255;
constexpr std::size_t kMaxBodies = 250;
constexpr std::size_t kLabels = 65536;

// Trabecular bone begins about here; muscle, cartilage and blood without contrast agent stay below 100 HU.
constexpr int kBoneHu = 150;
constexpr int kMaxReach = 4;

}  // namespace

LabelTable::LabelTable(const std::vector<std::vector<int>>& labels_of_bodies) : codes_(kLabels, kOtherLabel) {
  codes_[0] = kBackground;
  if (labels_of_bodies.size() > kMaxBodies) throw VolumeError("ct/mask: more than 250 bodies are not supported");
  for (std::size_t body = 0; body < labels_of_bodies.size(); ++body) {
    if (labels_of_bodies[body].empty()) throw VolumeError("ct/mask: a body has no label");
    for (const int label : labels_of_bodies[body]) {
      if (label < 1 || label >= static_cast<int>(kLabels)) {
        throw VolumeError("ct/mask: label " + std::to_string(label) + " of a body must lie within 1 and 65535");
      }
      std::uint8_t& code = codes_[static_cast<std::size_t>(label)];
      if (code != kOtherLabel) throw VolumeError("ct/mask: label " + std::to_string(label) + " stands twice in bodies");
      code = static_cast<std::uint8_t>(body + 1);
    }
  }
}

BodyMap::BodyMap(const VolumeGrid& grid, const LabelVolume& labels, const LabelTable& table)
    : size_(grid.size), codes_(grid.voxelCount()), boxes_(kMaxBodies, {grid.size, Eigen::Vector3i::Constant(-1)}) {
  Eigen::Vector3i at = Eigen::Vector3i::Zero();
  forEachLabel(labels, grid, 0, grid.size.z(), [&](std::size_t voxel, int label) {
    met_.set(static_cast<std::size_t>(label));
    const std::uint8_t code = table.codeOf(label);
    codes_[voxel] = code;
    if (code != kBackground && code != kOtherLabel) extend(code, at);
    if (++at.x() == size_.x()) {
      at.x() = 0;
      if (++at.y() == size_.y()) {
        at.y() = 0;
        ++at.z();
      }
    }
  });
}

void BodyMap::extend(std::uint8_t code, const Eigen::Vector3i& at) {
  IndexBox& box = boxes_[code - 1U];
  box.low = box.low.cwiseMin(at);
  box.high = box.high.cwiseMax(at);
}

int BodyMap::at(std::size_t voxel) const {
  if (codes_[voxel] == kOtherLabel) return -2;
  return static_cast<int>(codes_[voxel]) - 1;
}

IndexBox BodyMap::boxOf(int body) const { return boxes_[static_cast<std::size_t>(body)]; }

// The body that a background voxel joins, or background.
std::uint8_t BodyMap::grownCode(const Volume& ct, const Eigen::Vector3i& at) const {
  const std::size_t voxel = index(at.x(), at.y(), at.z());
  if (codes_[voxel] != kBackground || ct.hu[voxel] < kBoneHu) return kBackground;
  const std::array<std::size_t, 3> stride = {1, static_cast<std::size_t>(size_.x()),
                                             static_cast<std::size_t>(size_.x()) * size_.y()};
  std::uint8_t found = kBackground;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool up : {false, true}) {
      if (at[axis] == (up ? size_[axis] - 1 : 0)) continue;
      const std::size_t step = stride[static_cast<std::size_t>(axis)];
      const std::uint8_t code = codes_[up ? voxel + step : voxel - step];
      if (code == kBackground || code == found) continue;
      if (code == kOtherLabel || found != kBackground) return kBackground;
      found = code;
    }
  }
  return found;
}

void BodyMap::growInto(const Volume& ct, int steps) {
  struct Grown {
    Eigen::Vector3i at;
    std::uint8_t code;
  };
  for (int step = 0; step < steps; ++step) {
    std::vector<Grown> grown;
    for (const IndexBox& box : boxes_) {
      const Eigen::Vector3i low = (box.low.array() - 1).max(0);
      const Eigen::Vector3i high = (box.high.array() + 1).min(size_.array() - 1);
      if ((box.low.array() > box.high.array()).any()) continue;
      for (int z = low.z(); z <= high.z(); ++z) {
        for (int y = low.y(); y <= high.y(); ++y) {
          for (int x = low.x(); x <= high.x(); ++x) {
            const std::uint8_t code = grownCode(ct, {x, y, z});
            if (code != kBackground) grown.push_back({{x, y, z}, code});
          }
        }
      }
    }
    // Only now, so that the result does not depend on the order of the voxels.
    for (const Grown& one : grown) {
      codes_[index(one.at.x(), one.at.y(), one.at.z())] = one.code;
      extend(one.code, one.at);
    }
  }
}

int growthReach(const VolumeGrid& ct, const VolumeGrid& labels) {
  const double ratio = labels.spacing_mm.mean() / ct.spacing_mm.mean();
  return static_cast<int>(std::clamp(std::lround(ratio), 1L, static_cast<long>(kMaxReach)));
}

}  // namespace xray_registration

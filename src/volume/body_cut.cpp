#include "xray_registration/volume/body_cut.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "body_map.h"
#include "hounsfield.h"
#include "label_sampling.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

std::string nameOf(const std::vector<int>& labels) {
  std::ostringstream text;
  text << (labels.size() == 1 ? "label" : "labels");
  for (const int label : labels) text << ' ' << label;
  return text.str();
}

// Moves what is above the fill from the rest to the body, which gets the box of its voxels.
class Cutter {
 public:
  Cutter(const BodyMap& map, std::uint16_t fill, AttenuationVolume* rest) : map_(map), fill_(fill), rest_(rest) {}

  AttenuationVolume cut(int body) {
    const IndexBox box = map_.boxOf(body);
    AttenuationVolume part;
    part.grid = rest_->grid;
    part.grid.size = box.high - box.low + Eigen::Vector3i::Ones();
    part.grid.origin_ct_mm = rest_->grid.ctFromIndex() * box.low.cast<double>();
    part.scale_per_mm = rest_->scale_per_mm;
    part.values.reserve(part.grid.voxelCount());
    for (int z = box.low.z(); z <= box.high.z(); ++z) {
      for (int y = box.low.y(); y <= box.high.y(); ++y) {
        for (int x = box.low.x(); x <= box.high.x(); ++x) part.values.push_back(take(map_.index(x, y, z), body));
      }
    }
    return part;
  }

 private:
  std::uint16_t take(std::size_t voxel, int body) {
    std::uint16_t& value = rest_->values[voxel];
    if (map_.at(voxel) != body || value <= fill_) return 0;
    const int above = value - fill_;
    value = fill_;
    return static_cast<std::uint16_t>(above);
  }

  const BodyMap& map_;
  std::uint16_t fill_;
  AttenuationVolume* rest_;
};

}  // namespace

CutCt cutBodies(const Volume& ct, const AttenuationModel& model, const LabelVolume& labels,
                const std::vector<std::vector<int>>& labels_of_bodies) {
  checkLabels(labels);
  const LabelTable table(labels_of_bodies);
  CutCt result;
  result.whole = toAttenuation(ct, model);
  result.rest = result.whole;
  BodyMap map(ct.grid, labels, table);
  for (std::size_t body = 0; body < labels_of_bodies.size(); ++body) {
    for (const int label : labels_of_bodies[body]) {
      if (!map.met(label)) {
        throw VolumeError("ct/mask: no voxel of the CT '" + ct.name + "' has label " + std::to_string(label) +
                          " there; is the label right, and do the two overlap?");
      }
    }
  }
  map.growInto(ct, growthReach(ct.grid, labels.grid));
  const auto fill = static_cast<std::uint16_t>(std::min<double>(
      std::round(attenuationOf(kFillHu, model) / result.rest.scale_per_mm), std::numeric_limits<std::uint16_t>::max()));
  Cutter cutter(map, fill, &result.rest);
  for (std::size_t body = 0; body < labels_of_bodies.size(); ++body) {
    result.bodies.push_back(cutter.cut(static_cast<int>(body)));
    const auto& values = result.bodies.back().values;
    if (std::all_of(values.begin(), values.end(), [](std::uint16_t value) { return value == 0; })) {
      throw VolumeError("ct/mask: " + nameOf(labels_of_bodies[body]) + " of the CT '" + ct.name +
                        "' holds nothing denser than soft tissue, which X-rays could not show");
    }
  }
  return result;
}

}  // namespace xray_registration

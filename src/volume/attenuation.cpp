#include "xray_registration/volume/attenuation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <sstream>

#include "hounsfield.h"
#include "label_sampling.h"
#include "xray_registration/common/parallel.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

constexpr int kLowestHu = std::numeric_limits<std::int16_t>::min();
constexpr int kHighestHu = std::numeric_limits<std::int16_t>::max();
constexpr double kLargestValue = std::numeric_limits<std::uint16_t>::max();

// Share of a face that must be solid tissue. An arm crosses about 1 % of a large field of view; noise that makes three
// voxels of ten look like tissue leaves 0.3^5 = 0.24 % of them with four neighbours that do so too.
constexpr double kCutFaceShare = 0.005;
// Tissue of a face attenuates at least half as much as water: skin, fat and lung's edge do, foam and noise do not.
constexpr double kTissueShareOfWater = 0.5;

template <typename Value>
[[noreturn]] void refuse(const std::string& parameter, Value value, const std::string& what) {
  std::ostringstream message;
  message << parameter << " is " << value << ": " << what;
  throw VolumeError(message.str());
}

void check(const Volume& ct, const AttenuationModel& model) {
  if (!(model.water_per_mm > 0.0 && model.water_per_mm <= 1.0)) {
    refuse("ct/water_attenuation", model.water_per_mm, "it must lie in (0, 1] per millimetre; water has about 0.02");
  }
  if (!(model.threshold_hu >= kLowestHu && model.threshold_hu <= kHighestHu)) {
    refuse("ct/threshold_hu", model.threshold_hu, "it must lie within -32768 and 32767 HU");
  }
  if (ct.hu.empty() || ct.hu.size() != ct.grid.voxelCount()) {
    throw VolumeError("CT '" + ct.name + "': the number of voxels does not fit its grid");
  }
}

std::int16_t highestHu(const std::vector<std::int16_t>& hu) { return *std::max_element(hu.begin(), hu.end()); }

std::vector<std::uint16_t> lookUpTable(const AttenuationModel& model, double scale_per_mm) {
  std::vector<std::uint16_t> table(static_cast<std::size_t>(kHighestHu - kLowestHu + 1));
  for (int hu = kLowestHu; hu <= kHighestHu; ++hu) {
    const double value = std::round(attenuationOf(hu, model) / scale_per_mm);
    table[static_cast<std::size_t>(hu - kLowestHu)] = static_cast<std::uint16_t>(std::min(value, kLargestValue));
  }
  return table;
}

AttenuationVolume convert(const Volume& ct, const AttenuationModel& model) {
  check(ct, model);
  // The largest attenuation that occurs takes the whole range of the 16 bits.
  const double largest = attenuationOf(highestHu(ct.hu), model);
  if (!(largest > 0.0)) refuse("ct/threshold_hu", model.threshold_hu, "no voxel of CT '" + ct.name + "' lies above it");
  AttenuationVolume result;
  result.grid = ct.grid;
  result.scale_per_mm = static_cast<float>(largest / kLargestValue);
  result.values.resize(ct.hu.size());
  const std::vector<std::uint16_t> table = lookUpTable(model, result.scale_per_mm);
  const std::size_t slice = ct.hu.size() / static_cast<std::size_t>(ct.grid.size.z());
  parallelFor(ct.grid.size.z(), [&](int begin, int end) {
    for (std::size_t i = begin * slice; i < end * slice; ++i) {
      result.values[i] = table[static_cast<std::size_t>(ct.hu[i] - kLowestHu)];
    }
  });
  return result;
}

// Looks at one outer slice of the volume: a grid of tissue or not.
class Face {
 public:
  Face(const AttenuationVolume& volume, int axis, bool high, double tissue)
      : volume_(volume), u_axis_(axis == 0 ? 1 : 0), v_axis_(axis == 2 ? 1 : 2), tissue_(tissue) {
    const Eigen::Vector3i& size = volume.grid.size;
    stride_ = {1, size.x(), static_cast<std::ptrdiff_t>(size.x()) * size.y()};
    start_ = high ? stride_[static_cast<std::size_t>(axis)] * (size[axis] - 1) : 0;
    width_ = size[u_axis_];
    height_ = size[v_axis_];
  }

  // Share of the voxels that are tissue and whose neighbours in the face are tissue too.
  double solidShare() const {
    std::size_t solid = 0;
    for (int v = 0; v < height_; ++v) {
      for (int u = 0; u < width_; ++u) {
        if (isTissue(u, v) && isTissue(u - 1, v) && isTissue(u + 1, v) && isTissue(u, v - 1) && isTissue(u, v + 1)) {
          ++solid;
        }
      }
    }
    return static_cast<double>(solid) / (static_cast<double>(width_) * height_);
  }

 private:
  // Beyond the border the face is taken to go on as it is.
  bool isTissue(int u, int v) const {
    const std::ptrdiff_t index = start_ + std::clamp(u, 0, width_ - 1) * stride_[static_cast<std::size_t>(u_axis_)] +
                                 std::clamp(v, 0, height_ - 1) * stride_[static_cast<std::size_t>(v_axis_)];
    return volume_.values[static_cast<std::size_t>(index)] > tissue_;
  }

  const AttenuationVolume& volume_;
  int u_axis_;
  int v_axis_;
  double tissue_;
  std::array<std::ptrdiff_t, 3> stride_{};
  std::ptrdiff_t start_ = 0;
  int width_ = 0;
  int height_ = 0;
};

std::array<bool, 6> cutFaces(const AttenuationVolume& volume, const AttenuationModel& model) {
  const double tissue = kTissueShareOfWater * model.water_per_mm / volume.scale_per_mm;
  std::array<bool, 6> cut{};
  for (int face = 0; face < 6; ++face) {
    cut[static_cast<std::size_t>(face)] = Face(volume, face / 2, face % 2 == 1, tissue).solidShare() >= kCutFaceShare;
  }
  return cut;
}

std::string inWords(const std::vector<int>& labels) {
  std::string words;
  for (const int label : labels) words += (words.empty() ? "" : ", ") + std::to_string(label);
  return words;
}

// Clears what has none of the labels in the slices [begin, end); returns whether any voxel of theirs was met.
bool maskSlices(const LabelVolume& labels, const std::vector<int>& chosen, int begin, int end,
                AttenuationVolume* volume) {
  bool found = false;
  forEachLabel(labels, volume->grid, begin, end, [&](std::size_t voxel, int here) {
    if (std::find(chosen.begin(), chosen.end(), here) != chosen.end()) {
      found = true;
    } else {
      volume->values[voxel] = 0;
    }
  });
  return found;
}

}  // namespace

AttenuationVolume toAttenuation(const Volume& ct, const AttenuationModel& model) {
  AttenuationVolume result = convert(ct, model);
  result.face_is_cut = cutFaces(result, model);
  return result;
}

AttenuationVolume toAttenuation(const Volume& ct, const AttenuationModel& model, const LabelVolume& labels, int label) {
  return toAttenuation(ct, model, labels, std::vector<int>{label});
}

AttenuationVolume toAttenuation(const Volume& ct, const AttenuationModel& model, const LabelVolume& labels,
                                const std::vector<int>& chosen) {
  for (const int label : chosen) {
    if (label < 1 || label > std::numeric_limits<std::uint16_t>::max()) {
      refuse("ct/label", label, "it must lie within 1 and 65535");
    }
  }
  const std::string label = inWords(chosen);
  checkLabels(labels);
  AttenuationVolume result = convert(ct, model);
  std::mutex mutex;
  bool found = false;
  parallelFor(ct.grid.size.z(), [&](int begin, int end) {
    const bool found_here = maskSlices(labels, chosen, begin, end, &result);
    const std::lock_guard<std::mutex> lock(mutex);
    found = found || found_here;
  });
  if (!found) {
    refuse("ct/label", label, "no voxel of the CT '" + ct.name + "' has this label in ct/mask; do the two overlap?");
  }
  if (std::all_of(result.values.begin(), result.values.end(), [](std::uint16_t value) { return value == 0; })) {
    refuse("ct/label", label, "all its voxels are air, that is below ct/threshold_hu");
  }
  return result;
}

Eigen::Vector3d anatomicalCentreCt(const AttenuationVolume& attenuation) {
  const Eigen::Vector3i& size = attenuation.grid.size;
  Eigen::Vector3i low = size;
  Eigen::Vector3i high = Eigen::Vector3i::Constant(-1);
  std::mutex mutex;
  parallelFor(size.z(), [&](int begin, int end) {
    Eigen::Vector3i part_low = size;
    Eigen::Vector3i part_high = Eigen::Vector3i::Constant(-1);
    for (int z = begin; z < end; ++z) {
      for (int y = 0; y < size.y(); ++y) {
        const auto row = attenuation.values.begin() +
                         static_cast<std::ptrdiff_t>((static_cast<std::size_t>(z) * size.y() + y) * size.x());
        const auto row_end = row + size.x();
        const auto first = std::find_if(row, row_end, [](std::uint16_t value) { return value != 0; });
        if (first == row_end) continue;
        auto last = row_end - 1;
        while (*last == 0) --last;
        part_low = part_low.cwiseMin(Eigen::Vector3i(static_cast<int>(first - row), y, z));
        part_high = part_high.cwiseMax(Eigen::Vector3i(static_cast<int>(last - row), y, z));
      }
    }
    const std::lock_guard<std::mutex> lock(mutex);
    low = low.cwiseMin(part_low);
    high = high.cwiseMax(part_high);
  });
  if ((high.array() < 0).any()) return attenuation.grid.centreCt();
  return attenuation.grid.ctFromIndex() * (0.5 * (low + high).cast<double>()).eval();
}

}  // namespace xray_registration

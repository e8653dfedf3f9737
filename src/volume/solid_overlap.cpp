#include "xray_registration/volume/solid_overlap.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "solid_cells.h"

namespace xray_registration {
namespace {

constexpr double kFull = 255.0;

struct Interval {
  double low;
  double high;
};

// The i in [0, last] for which start + i step lies within [-0.5, size - 0.5).
Interval clipped(Interval range, double start, double step, int size) {
  const double to_low = -0.5 - start;
  const double to_high = size - 0.5 - start;
  if (std::abs(step) < 1e-12) {
    if (to_low > 0.0 || to_high <= 0.0) return {1.0, 0.0};
    return range;
  }
  const double a = to_low / step;
  const double b = to_high / step;
  return {std::max(range.low, std::min(a, b)), std::min(range.high, std::max(a, b))};
}

}  // namespace

SolidBody::SolidBody(const AttenuationVolume& volume, double threshold_per_mm, double tolerance_mm) {
  if (!(threshold_per_mm >= 0.0)) throw std::invalid_argument("a solid's threshold must not be negative");
  if (!(tolerance_mm >= 0.0 && tolerance_mm <= 100.0)) {
    throw std::invalid_argument("a solid's tolerance must lie in 0…100 mm");
  }
  const SolidCells cells = solidCells(volume, threshold_per_mm);
  grid_ = cells.grid;
  share_ = shareBelowSurface(cells, tolerance_mm);
  collectRuns();
}

void SolidBody::collectRuns() {
  std::size_t cell = 0;
  for (int z = 0; z < grid_.size.z() && !share_.empty(); ++z) {
    for (int y = 0; y < grid_.size.y(); ++y) {
      bool in_run = false;
      for (int x = 0; x < grid_.size.x(); ++x, ++cell) {
        if (share_[cell] == 0) {
          in_run = false;
        } else if (in_run) {
          ++runs_.back().length;
        } else {
          runs_.push_back({{x, y, z}, 1});
          in_run = true;
        }
      }
    }
  }
}

double SolidBody::volumeMm3() const {
  const auto sum = std::accumulate(share_.begin(), share_.end(), std::uint64_t{0});
  return static_cast<double>(sum) / kFull * grid_.spacing_mm.prod();
}

// Sum of the products of shares, along a run of this body.
double SolidBody::overlapOfRun(const Run& run, const SolidBody& other, const Eigen::Affine3d& other_from_cell) const {
  const Eigen::Vector3d start = other_from_cell * run.begin.cast<double>();
  const Eigen::Vector3d step = other_from_cell.linear().col(0);
  Interval range = {0.0, run.length - 1.0};
  for (int axis = 0; axis < 3; ++axis) range = clipped(range, start[axis], step[axis], other.grid_.size[axis]);
  const int first = static_cast<int>(std::ceil(range.low));
  const int last = static_cast<int>(std::floor(range.high));
  const Eigen::Vector3i& n = other.grid_.size;
  const std::uint8_t* share =
      share_.data() + (static_cast<std::size_t>(run.begin.z()) * grid_.size.y() + run.begin.y()) * grid_.size.x() +
      run.begin.x();
  std::uint64_t sum = 0;
  for (int i = first; i <= last; ++i) {
    const Eigen::Array3d at = (start + i * step).array() + 0.5;
    // The clip leaves nothing outside but by rounding.
    const int x = std::clamp(static_cast<int>(at.x()), 0, n.x() - 1);
    const int y = std::clamp(static_cast<int>(at.y()), 0, n.y() - 1);
    const int z = std::clamp(static_cast<int>(at.z()), 0, n.z() - 1);
    sum += static_cast<std::uint64_t>(share[i]) * other.share_[(static_cast<std::size_t>(z) * n.y() + y) * n.x() + x];
  }
  return static_cast<double>(sum);
}

double overlapMm3(const SolidBody& a, const SolidBody& b, const RigidTransform& T_a_b) {
  if (a.runs_.empty() || b.runs_.empty()) return 0.0;
  // The finer cells are looked up in the coarser ones.
  if (b.cellMm() < a.cellMm()) return overlapMm3(b, a, T_a_b.inverse());
  const double reach =
      0.5 * (a.grid_.size.cast<double>().norm() * a.cellMm() + b.grid_.size.cast<double>().norm() * b.cellMm());
  if ((T_a_b * b.grid_.centreCt() - a.grid_.centreCt()).norm() > reach) return 0.0;
  const Eigen::Affine3d b_from_cell =
      b.grid_.ctFromIndex().inverse() * Eigen::Affine3d(T_a_b.inverse().matrix()) * a.grid_.ctFromIndex();
  double sum = 0.0;
  for (const SolidBody::Run& run : a.runs_) sum += a.overlapOfRun(run, b, b_from_cell);
  return sum / (kFull * kFull) * a.grid_.spacing_mm.prod();
}

}  // namespace xray_registration

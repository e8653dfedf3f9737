#include "evaluation/wrong_ct.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "xray_registration/evaluation/random_starts.h"

namespace xray_registration {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::int16_t kAirBelowHu = -500;

int largestOf(const Eigen::Vector3d& values) {
  int largest = 0;
  values.cwiseAbs().maxCoeff(&largest);
  return largest;
}

/// The grid's centre stays when only spacing and direction were changed.
void moveCentreTo(const Eigen::Vector3d& centre_ct_mm, VolumeGrid* grid) {
  grid->origin_ct_mm += centre_ct_mm - grid->centreCt();
}

std::size_t offsetOf(const VolumeGrid& grid, int x, int y, int z) {
  return static_cast<std::size_t>(x) +
         static_cast<std::size_t>(grid.size.x()) *
             (static_cast<std::size_t>(y) + static_cast<std::size_t>(grid.size.y()) * static_cast<std::size_t>(z));
}

/// Trilinear; outside, the border's voxels are repeated, so that a cut body stays cut at its face.
double interpolated(const Volume& ct, const Eigen::Vector3d& index) {
  Eigen::Vector3i low;
  Eigen::Vector3i high;
  Eigen::Vector3d share;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = ct.grid.size[axis] - 1;
    const double inside = std::clamp(index[axis], 0.0, static_cast<double>(last));
    low[axis] = static_cast<int>(inside);
    high[axis] = std::min(low[axis] + 1, last);
    share[axis] = inside - low[axis];
  }
  const auto alongX = [&](int y, int z) {
    return (1.0 - share.x()) * ct.hu[offsetOf(ct.grid, low.x(), y, z)] +
           share.x() * ct.hu[offsetOf(ct.grid, high.x(), y, z)];
  };
  const double at_low = (1.0 - share.y()) * alongX(low.y(), low.z()) + share.y() * alongX(high.y(), low.z());
  const double at_high = (1.0 - share.y()) * alongX(low.y(), high.z()) + share.y() * alongX(high.y(), high.z());
  return (1.0 - share.z()) * at_low + share.z() * at_high;
}

/// @param source  Point of the result → where in `ct` it comes from; CT frame, mm.
template <typename Source>
Volume warped(const Volume& ct, const Source& source) {
  Volume result = ct;
  const Eigen::Affine3d ct_from_index = ct.grid.ctFromIndex();
  const Eigen::Affine3d index_from_ct = ct_from_index.inverse();
  for (int z = 0; z < ct.grid.size.z(); ++z) {
    for (int y = 0; y < ct.grid.size.y(); ++y) {
      for (int x = 0; x < ct.grid.size.x(); ++x) {
        const Eigen::Vector3d point_mm = ct_from_index * Eigen::Vector3d(x, y, z);
        const double hu = interpolated(ct, index_from_ct * source(point_mm));
        result.hu[offsetOf(ct.grid, x, y, z)] = static_cast<std::int16_t>(std::lround(hu));
      }
    }
  }
  return result;
}

/// Points of the body, some thousand of them, evenly spread.
std::vector<Eigen::Vector3d> bodyPoints(const Volume& ct) {
  constexpr int kPerAxis = 32;
  const Eigen::Vector3i step = (ct.grid.size / kPerAxis).cwiseMax(1);
  const Eigen::Affine3d ct_from_index = ct.grid.ctFromIndex();
  std::vector<Eigen::Vector3d> points;
  for (int z = 0; z < ct.grid.size.z(); z += step.z()) {
    for (int y = 0; y < ct.grid.size.y(); y += step.y()) {
      for (int x = 0; x < ct.grid.size.x(); x += step.x()) {
        if (ct.hu[offsetOf(ct.grid, x, y, z)] < kAirBelowHu) continue;
        points.push_back(ct_from_index * Eigen::Vector3d(x, y, z));
      }
    }
  }
  return points;
}

/// What a small rigid motion [v; ω] about `centre` does to a point.
Eigen::Vector3d moved(const Twist& motion, const Eigen::Vector3d& from_centre) {
  return motion.head<3>() + motion.tail<3>().cross(from_centre);
}

/// A smooth field of displacements, mm.
class Bending {
 public:
  Bending(const Volume& ct, double largest_mm, std::uint64_t seed);

  Eigen::Vector3d at(const Eigen::Vector3d& point_ct_mm) const {
    return scale_ * (waves(point_ct_mm - centre_) - moved(rigid_, point_ct_mm - centre_));
  }

 private:
  struct Wave {
    Eigen::Vector3d amplitude;
    Eigen::Vector3d rad_per_mm;
    double phase;
  };

  Eigen::Vector3d waves(const Eigen::Vector3d& from_centre) const;
  void leaveRigidPartOut(const std::vector<Eigen::Vector3d>& points);

  std::vector<Wave> waves_;
  Eigen::Vector3d centre_;
  Twist rigid_ = Twist::Zero();
  double scale_ = 1.0;
};

Bending::Bending(const Volume& ct, double largest_mm, std::uint64_t seed) : centre_(ct.grid.centreCt()) {
  RandomStarts random({1.0, kPi}, seed);
  const double extent_mm = ct.grid.size.cast<double>().cwiseProduct(ct.grid.spacing_mm).maxCoeff();
  // Longer waves would be little but rigid, shorter ones would tear bones.
  for (const double length : {0.7, 1.0, 1.4}) {
    const Twist direction = random.next();
    const Twist amplitude = random.next();
    waves_.push_back({amplitude.tail<3>().normalized(),
                      direction.tail<3>().normalized() * 2.0 * kPi / (length * extent_mm), direction[0]});
  }
  const std::vector<Eigen::Vector3d> points = bodyPoints(ct);
  leaveRigidPartOut(points);
  double largest = 0.0;
  for (const Eigen::Vector3d& point : points) largest = std::max(largest, at(point).norm());
  if (largest > 0.0) scale_ = largest_mm / largest;
}

Eigen::Vector3d Bending::waves(const Eigen::Vector3d& from_centre) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Wave& wave : waves_) sum += wave.amplitude * std::sin(wave.rad_per_mm.dot(from_centre) + wave.phase);
  return sum;
}

/// Least squares over the body.
void Bending::leaveRigidPartOut(const std::vector<Eigen::Vector3d>& points) {
  Matrix6d matrix = Matrix6d::Zero();
  Twist right = Twist::Zero();
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d from_centre = point - centre_;
    Eigen::Matrix<double, 3, 6> columns;
    for (int i = 0; i < 6; ++i) columns.col(i) = moved(Twist::Unit(i), from_centre);
    matrix += columns.transpose() * columns;
    right += columns.transpose() * waves(from_centre);
  }
  rigid_ = matrix.completeOrthogonalDecomposition().solve(right);
}

}  // namespace

Volume scaled(Volume ct, const Eigen::Vector3d& factors) {
  const Eigen::Vector3d centre_ct_mm = ct.grid.centreCt();
  for (int i = 0; i < 3; ++i) ct.grid.spacing_mm[i] *= factors[largestOf(ct.grid.direction.col(i))];
  moveCentreTo(centre_ct_mm, &ct.grid);
  return ct;
}

Volume mirrored(Volume ct) {
  const Eigen::Vector3d centre_ct_mm = ct.grid.centreCt();
  // Voxels in the opposite order along one index axis, and the axes mirrored: both together keep the handedness.
  const int axis = largestOf(ct.grid.direction.row(0));
  const std::vector<std::int16_t> hu = ct.hu;
  const Eigen::Vector3i size = ct.grid.size;
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        Eigen::Vector3i opposite(x, y, z);
        opposite[axis] = size[axis] - 1 - opposite[axis];
        ct.hu[offsetOf(ct.grid, x, y, z)] = hu[offsetOf(ct.grid, opposite.x(), opposite.y(), opposite.z())];
      }
    }
  }
  ct.grid.direction.row(0) *= -1.0;
  ct.grid.direction.col(axis) *= -1.0;
  moveCentreTo(centre_ct_mm, &ct.grid);
  return ct;
}

Volume sheared(const Volume& ct, double shear) {
  const Eigen::Vector3d centre_ct_mm = ct.grid.centreCt();
  Eigen::Matrix3d result_from_ct = Eigen::Matrix3d::Identity();
  result_from_ct(0, 2) = result_from_ct(2, 0) = 0.5 * shear;
  const Eigen::Matrix3d ct_from_result = result_from_ct.inverse();
  return warped(ct, [&](const Eigen::Vector3d& point) {
    return (centre_ct_mm + ct_from_result * (point - centre_ct_mm)).eval();
  });
}

Volume bent(const Volume& ct, double largest_mm, std::uint64_t seed) {
  const Bending bending(ct, largest_mm, seed);
  return warped(ct, [&](const Eigen::Vector3d& point) { return (point + bending.at(point)).eval(); });
}

Volume centredLike(const Volume& place, Volume ct) {
  moveCentreTo(place.grid.centreCt(), &ct.grid);
  return ct;
}

}  // namespace xray_registration

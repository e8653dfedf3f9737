#include "phantom_shapes.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace xray_registration {
namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

}  // namespace

void ShapeList::add(const Eigen::Vector3d& centre, const Eigen::Vector3d& semi_axes, double hu,
                    const Eigen::Vector3d& turn_deg) {
  const Eigen::Vector3d turn = kRadPerDeg * turn_deg;
  const Eigen::Matrix3d rotation =
      (Eigen::AngleAxisd(turn.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(turn.y(), Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(turn.x(), Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  shapes_.push_back({centre + shift_mm_, semi_axes, rotation, hu, label_});
}

void ShapeList::addBone(const Eigen::Vector3d& centre, const Eigen::Vector3d& semi_axes, double shell_mm,
                        const Eigen::Vector3d& turn_deg, double shell_hu, double core_hu) {
  add(centre, semi_axes, shell_hu, turn_deg);
  const Eigen::Vector3d core = semi_axes.array() - shell_mm;
  if ((core.array() > 0.5).all()) add(centre, core, core_hu, turn_deg);
}

void ShapeList::addRod(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_mm, double hu) {
  const Eigen::Vector3d along = to - from;
  const Eigen::Matrix3d rotation =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), along).toRotationMatrix();
  // An ellipsoid tapers; a little longer than asked, it is about as thick as asked over most of its length.
  const Eigen::Vector3d semi_axes(0.55 * along.norm(), radius_mm, radius_mm);
  shapes_.push_back({0.5 * (from + to) + shift_mm_, semi_axes, rotation, hu, label_});
}

void ShapeList::addPieces(int count, const Eigen::Vector3d& centre, const Eigen::Vector3d& semi_axes, double inner,
                          const Eigen::Vector2d& radius_mm, const Eigen::Vector2d& hu) {
  for (int placed = 0; placed < count;) {
    const double x = uniform(-1.0, 1.0);
    const double y = uniform(-1.0, 1.0);
    const double z = uniform(-1.0, 1.0);
    const double radius = std::sqrt(x * x + y * y + z * z);
    if (radius > 1.0 || radius < inner) continue;
    const double a = uniform(radius_mm.x(), radius_mm.y());
    const double b = uniform(radius_mm.x(), radius_mm.y());
    const double value = uniform(hu.x(), hu.y());
    add(centre + Eigen::Vector3d(x, y, z).cwiseProduct(semi_axes), {a, b, 0.5 * (a + b)}, value,
        {40.0 * x, 0, 60.0 * y});
    ++placed;
  }
}

// The generator's own bits, since the standard's distributions differ between libraries.
double ShapeList::uniform(double low, double high) { return low + (high - low) * (random_() / 4294967296.0); }

VolumeGrid phantomGrid(const Eigen::Vector3d& extent_mm, double spacing_mm, const Eigen::Vector3d& centre_ct_mm) {
  if (!(spacing_mm >= 0.2 && spacing_mm <= 20.0)) {
    std::ostringstream message;
    message << "a phantom's voxel size must lie within 0.2 and 20 mm, not " << spacing_mm;
    throw std::invalid_argument(message.str());
  }
  VolumeGrid grid;
  grid.size = (extent_mm / spacing_mm).array().ceil().matrix().cast<int>();
  grid.spacing_mm.setConstant(spacing_mm);
  grid.origin_ct_mm = centre_ct_mm - 0.5 * spacing_mm * (grid.size.cast<double>() - Eigen::Vector3d::Ones());
  return grid;
}

}  // namespace xray_registration

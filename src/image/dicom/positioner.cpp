#include "image/dicom/positioner.h"

#include <cmath>

#include "xray_registration/geometry/angles.h"

namespace xray_registration {

PositionerAxes positionerAxes(double primary_deg, double secondary_deg) {
  const double primary = primary_deg / kDegreesPerRadian;
  const double secondary = secondary_deg / kDegreesPerRadian;
  const double sp = std::sin(primary), cp = std::cos(primary);
  const double ss = std::sin(secondary), cs = std::cos(secondary);
  return {{sp * cs, -cp * cs, ss}, {cp, sp, 0.0}, {sp * ss, -cp * ss, -cs}};
}

namespace dicom {
namespace {

// Words for directions are rough: of an oblique picture they name the nearest ones.
constexpr double kLeastAgreement = 0.7071;

/// "LP" → the direction between left and back; zero for what is no direction.
Eigen::Vector3d direction(const std::string& word) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 1.0;
  for (const char letter : word) {
    switch (letter) {
      case 'L':
        sum.x() += weight;
        break;
      case 'R':
        sum.x() -= weight;
        break;
      case 'P':
        sum.y() += weight;
        break;
      case 'A':
        sum.y() -= weight;
        break;
      case 'H':
        sum.z() += weight;
        break;
      case 'F':
        sum.z() -= weight;
        break;
      default:
        return Eigen::Vector3d::Zero();
    }
    weight *= 0.5;  // The first letter is the main direction.
  }
  return sum.norm() > 0.0 ? Eigen::Vector3d(sum.normalized()) : sum;
}

}  // namespace

PositionerAxes storedAxes(PositionerAxes axes, double rotation_deg, bool flipped) {
  const int quarters = static_cast<int>(std::lround(rotation_deg / 90.0)) & 3;
  for (int i = 0; i < quarters; ++i) {
    // Turned clockwise, what was on top is on the right.
    const Eigen::Vector3d columns = axes.columns;
    axes.columns = -axes.rows;
    axes.rows = columns;
  }
  if (flipped) axes.columns = -axes.columns;
  return axes;
}

std::optional<PositionerAxes> axesAlong(const PositionerAxes& axes,
                                        const std::vector<std::string>& patient_orientation) {
  if (patient_orientation.size() != 2) return std::nullopt;
  const Eigen::Vector3d columns = direction(patient_orientation[0]);
  const Eigen::Vector3d rows = direction(patient_orientation[1]);
  std::optional<PositionerAxes> best;
  double best_agreement = 2.0 * kLeastAgreement;
  for (int quarters = 0; quarters < 4; ++quarters) {
    for (const bool flipped : {false, true}) {
      const PositionerAxes turned = storedAxes(axes, 90.0 * quarters, flipped);
      const double agreement = turned.columns.dot(columns) + turned.rows.dot(rows);
      if (agreement <= best_agreement) continue;
      best = turned;
      best_agreement = agreement;
    }
  }
  return best;
}

}  // namespace dicom
}  // namespace xray_registration

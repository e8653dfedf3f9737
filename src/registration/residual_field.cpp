#include "registration/residual_field.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace xray_registration {
namespace {

/// Cosines along each axis of the shadow: waves down to two thirds of its size.
constexpr int kWaves = 4;
constexpr int kFields = kWaves * kWaves;
/// Parameters of a view: what moves columns, then what moves rows.
constexpr int kOfView = 2 * kFields;
/// Curvature that keeps a field small where no window sees it, as share of that by a shift of everything.
constexpr double kRidge = 1e-2;
/// A window with less is flat, and does not say where the shadow ends.
constexpr double kContent = 0.5;

using Fields = Eigen::Matrix<double, kFields, 1>;

/// The tiles that a view's shadow covers, and the fields on them.
class FieldBasis {
 public:
  void cover(const SetupWindow& window) {
    first_x_ = std::min<double>(first_x_, window.x);
    first_y_ = std::min<double>(first_y_, window.y);
    last_x_ = std::max<double>(last_x_, window.x + 1);
    last_y_ = std::max<double>(last_y_, window.y + 1);
  }
  Fields at(const SetupWindow& window) const {
    const double x = (window.x + 0.5 - first_x_) / (last_x_ - first_x_);
    const double y = (window.y + 0.5 - first_y_) / (last_y_ - first_y_);
    Fields fields;
    for (int i = 0; i < kWaves; ++i) {
      for (int j = 0; j < kWaves; ++j) fields[i * kWaves + j] = std::cos(M_PI * i * x) * std::cos(M_PI * j * y);
    }
    return fields;
  }

 private:
  double first_x_ = std::numeric_limits<double>::max(), first_y_ = std::numeric_limits<double>::max();
  double last_x_ = std::numeric_limits<double>::lowest(), last_y_ = std::numeric_limits<double>::lowest();
};

/// Gradients and matrix by the fields' coefficients in mm at the CT.
struct FieldSums {
  FieldSums(Eigen::Index parameters, Eigen::Index windows)
      : gradients(Eigen::MatrixXd::Zero(parameters, windows)),
        matrix(Eigen::MatrixXd::Zero(parameters, parameters)),
        with_pose(Eigen::MatrixXd::Zero(6, parameters)) {}

  void add(const SetupWindow& window, const Eigen::Vector2d& gradient_px, const Fields& fields, double mm_per_pixel);

  Eigen::MatrixXd gradients;  ///< Window by window.
  Eigen::MatrixXd matrix;
  Eigen::MatrixXd with_pose;
  double by_shift = 0.0;  ///< Curvature by a shift of everything, mean of the axes.
  Eigen::Index added = 0;
};

void FieldSums::add(const SetupWindow& window, const Eigen::Vector2d& gradient_px, const Fields& fields,
                    double mm_per_pixel) {
  const auto first = static_cast<Eigen::Index>(window.view) * kOfView;
  const Eigen::Matrix2d by_shift_mm = window.by_shift / (mm_per_pixel * mm_per_pixel);
  const Eigen::Matrix<double, kFields, kFields> products = fields * fields.transpose();
  for (int a = 0; a < 2; ++a) {
    const Eigen::Index row = first + a * kFields;
    gradients.block<kFields, 1>(row, added) = gradient_px[a] / mm_per_pixel * fields;
    with_pose.block<6, kFields>(0, row) += window.pose_by_shift.col(a) / mm_per_pixel * fields.transpose();
    for (int b = 0; b < 2; ++b) {
      matrix.block<kFields, kFields>(row, first + b * kFields) += by_shift_mm(a, b) * products;
    }
  }
  by_shift += 0.5 * by_shift_mm.trace();
  ++added;
}

FieldSums sumsOf(const SetupEvidence& evidence) {
  const std::size_t views = evidence.mm_per_pixel.size();
  const SetupLayout layout(views);
  std::vector<FieldBasis> bases(views);
  for (const SetupWindow& window : evidence.windows) {
    if (window.content > kContent) bases[window.view].cover(window);
  }
  FieldSums sums(kOfView * static_cast<Eigen::Index>(views), evidence.gradients.cols());
  for (const SetupWindow& window : evidence.windows) {
    const auto gradient_px = evidence.gradients.block<2, 1>(layout.of(window.view, SetupLayout::kCentre), sums.added);
    sums.add(window, gradient_px, bases[window.view].at(window), evidence.mm_per_pixel[window.view]);
  }
  return sums;
}

}  // namespace

ResidualField residualField(const SetupEvidence& evidence) {
  ResidualField field;
  const Eigen::LDLT<Matrix6d> pose(Matrix6d(evidence.matrix.topLeftCorner<6, 6>()));
  if (pose.info() != Eigen::Success || !(pose.vectorD().minCoeff() > 0.0)) return field;
  const FieldSums sums = sumsOf(evidence);
  if (!(sums.by_shift > 0.0) || !sums.gradients.allFinite()) return field;
  const Eigen::MatrixXd follows = pose.solve(sums.with_pose);
  const Eigen::MatrixXd parts = sums.gradients - follows.transpose() * evidence.gradients.topRows<6>();
  Eigen::MatrixXd curvature = sums.matrix - sums.with_pose.transpose() * follows;
  curvature.diagonal().array() += kRidge * sums.by_shift;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(curvature);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0.0)) return field;
  const Eigen::VectorXd score = parts.rowwise().sum();
  const Eigen::MatrixXd noise = ldlt.solve(parts * parts.transpose());
  const double spread = std::sqrt(2.0 * (noise * noise).trace());
  field.gain = score.dot(ldlt.solve(score));
  const double above = field.gain - noise.trace();
  field.rms_mm = std::sqrt(std::max(above, 0.0) / sums.by_shift);
  // σ of a root; of a root near zero, the root of σ.
  const double spread_mm2 = spread / sums.by_shift;
  field.sigma_mm = spread_mm2 / (2.0 * std::max(field.rms_mm, 0.5 * std::sqrt(spread_mm2)));
  field.deviations = spread > 0.0 ? above / spread : 0.0;
  field.determined = std::isfinite(field.deviations) && std::isfinite(field.rms_mm);
  return field;
}

}  // namespace xray_registration

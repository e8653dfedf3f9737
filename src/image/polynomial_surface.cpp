#include "image/polynomial_surface.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "xray_registration/common/statistics.h"

namespace xray_registration {
namespace {

using Powers = std::array<double, PolynomialSurface::kHighestDegree + 1>;

/// Samples per term below which a degree is not tried.
constexpr int kSamplesPerTerm = 3;
constexpr std::size_t kFolds = 5;
/// A higher degree must predict better by this share. Less is not the detector's: a plate's own errors go along its
/// rows of holes, so that some rows' points predict others of the same rows.
constexpr double kWorthADegree = 0.05;
/// Beyond so many standard deviations a sample is no measurement of this surface.
constexpr double kOutlier = 5.0;
/// The degree that outliers are first looked for with: enough for the distortions of image intensifiers.
constexpr int kFirstDegree = 5;

Powers powersOf(double x, int degree) {
  Powers powers{};
  powers[0] = 1.0;
  for (int i = 1; i <= degree; ++i) powers[static_cast<std::size_t>(i)] = powers[static_cast<std::size_t>(i) - 1] * x;
  return powers;
}

/// Calls term(k, i, j) for each xⁱ yʲ.
template <typename Term>
void forTerms(int degree, const Term& term) {
  int k = 0;
  for (int total = 0; total <= degree; ++total) {
    for (int j = 0; j <= total; ++j) {
      term(k++, static_cast<std::size_t>(total - j), static_cast<std::size_t>(j));
    }
  }
}

class Fitter {
 public:
  explicit Fitter(const std::vector<PlaneSample>& samples) : samples_(samples), used_(samples.size(), true) {
    for (const PlaneSample& sample : samples) centre_ += sample.from / static_cast<double>(samples.size());
    for (const PlaneSample& sample : samples) scale_ = std::max(scale_, (sample.from - centre_).norm());
  }

  SurfaceFit fit() {
    leaveOutOutliers(std::min(kFirstDegree, highestDegree()));
    SurfaceFit result;
    const int degree = bestDegree(&result.cross_validated_rms);
    // Those that only a higher degree explains come back.
    leaveOutOutliers(degree);
    result.surface = fitTo(degree, [this](std::size_t i) { return used_[i]; });
    result.used = used_;
    return result;
  }

 private:
  int highestDegree() const {
    const auto count = static_cast<int>(std::count(used_.begin(), used_.end(), true));
    int degree = 1;
    while (degree < PolynomialSurface::kHighestDegree &&
           kSamplesPerTerm * PolynomialSurface::termCount(degree + 1) <= count) {
      ++degree;
    }
    return degree;
  }

  template <typename Takes>
  PolynomialSurface fitTo(int degree, const Takes& takes) const {
    PolynomialSurface surface{degree, centre_, scale_, {}};
    const auto rows = static_cast<Eigen::Index>(samples_.size());
    Eigen::MatrixXd terms = Eigen::MatrixXd::Zero(rows, PolynomialSurface::termCount(degree));
    Eigen::MatrixX2d values = Eigen::MatrixX2d::Zero(rows, 2);
    for (std::size_t row = 0; row < samples_.size(); ++row) {
      if (!takes(row)) continue;
      const Eigen::Vector2d point = (samples_[row].from - centre_) / scale_;
      const Powers x = powersOf(point.x(), degree);
      const Powers y = powersOf(point.y(), degree);
      const auto index = static_cast<Eigen::Index>(row);
      forTerms(degree, [&](int k, std::size_t i, std::size_t j) { terms(index, k) = x[i] * y[j]; });
      values.row(index) = samples_[row].to.transpose();
    }
    surface.coefficients = terms.colPivHouseholderQr().solve(values);
    return surface;
  }

  double residual(const PolynomialSurface& surface, std::size_t i) const {
    return (surface.at(samples_[i].from) - samples_[i].to).norm();
  }

  void leaveOutOutliers(int degree) {
    std::fill(used_.begin(), used_.end(), true);
    for (int pass = 0; pass < 3; ++pass) {
      const PolynomialSurface surface = fitTo(degree, [this](std::size_t i) { return used_[i]; });
      std::vector<double> residuals;
      for (std::size_t i = 0; i < samples_.size(); ++i) residuals.push_back(residual(surface, i));
      // The median length of a two-dimensional normal error is 1.18 standard deviations.
      const double limit = kOutlier * median(residuals) / 1.18 + 1e-9 * scale_;
      for (std::size_t i = 0; i < samples_.size(); ++i) used_[i] = residuals[i] <= limit;
    }
  }

  double crossValidated(int degree) const {
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t fold = 0; fold < kFolds; ++fold) {
      const PolynomialSurface surface =
          fitTo(degree, [this, fold](std::size_t i) { return used_[i] && i % kFolds != fold; });
      for (std::size_t i = fold; i < samples_.size(); i += kFolds) {
        if (!used_[i]) continue;
        sum += std::pow(residual(surface, i), 2);
        count += 1.0;
      }
    }
    return std::sqrt(sum / std::max(count, 1.0));
  }

  int bestDegree(double* cross_validated_rms) const {
    std::vector<double> errors;
    for (int degree = 1; degree <= highestDegree(); ++degree) errors.push_back(crossValidated(degree));
    const double allowed = (1.0 + kWorthADegree) * *std::min_element(errors.begin(), errors.end()) + 1e-12 * scale_;
    const auto chosen =
        std::find_if(errors.begin(), errors.end(), [allowed](double error) { return error <= allowed; });
    *cross_validated_rms = *chosen;
    return static_cast<int>(chosen - errors.begin()) + 1;
  }

  const std::vector<PlaneSample>& samples_;
  std::vector<bool> used_;
  Eigen::Vector2d centre_ = Eigen::Vector2d::Zero();
  double scale_ = 1e-9;
};

}  // namespace

Eigen::Vector2d PolynomialSurface::at(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d p = (point - centre) / scale;
  const Powers x = powersOf(p.x(), degree);
  const Powers y = powersOf(p.y(), degree);
  Eigen::Vector2d value = Eigen::Vector2d::Zero();
  forTerms(degree,
           [&](int k, std::size_t i, std::size_t j) { value += x[i] * y[j] * coefficients.row(k).transpose(); });
  return value;
}

Eigen::Matrix2d PolynomialSurface::jacobianAt(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d p = (point - centre) / scale;
  const Powers x = powersOf(p.x(), degree);
  const Powers y = powersOf(p.y(), degree);
  Eigen::Matrix2d jacobian = Eigen::Matrix2d::Zero();
  forTerms(degree, [&](int k, std::size_t i, std::size_t j) {
    const Eigen::Vector2d c = coefficients.row(k).transpose() / scale;
    if (i > 0) jacobian.col(0) += static_cast<double>(i) * x[i - 1] * y[j] * c;
    if (j > 0) jacobian.col(1) += static_cast<double>(j) * x[i] * y[j - 1] * c;
  });
  return jacobian;
}

SurfaceFit fitSurface(const std::vector<PlaneSample>& samples) {
  if (samples.size() < kFewestSamples) {
    throw std::invalid_argument(std::to_string(samples.size()) + " points are too few for a smooth map; at least " +
                                std::to_string(kFewestSamples));
  }
  return Fitter(samples).fit();
}

}  // namespace xray_registration

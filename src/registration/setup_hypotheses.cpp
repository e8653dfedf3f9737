#include "registration/setup_hypotheses.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "xray_registration/geometry/angles.h"

namespace xray_registration {
namespace {

constexpr double kPercent = 100.0;
/// A distortion's coefficient in percent at half an image of 256 mm at 1 m, where C-arms state it.
constexpr double kPercentAtRim = 100.0 * 0.128 * 0.128;
const char* const kCalibrate = "recalibrate (rosrun xray_registration calibrate)";

/// One parameter of the layout, or the same one of several views.
Eigen::VectorXd unitOf(const SetupLayout& layout, const std::vector<std::size_t>& views, int parameter) {
  Eigen::VectorXd unit = Eigen::VectorXd::Zero(layout.size());
  for (const std::size_t view : views) unit[layout.of(view, parameter)] = 1.0;
  return unit;
}

/// So many parameters of the views' blocks from `first` on.
Eigen::MatrixXd basisOf(const SetupLayout& layout, const std::vector<std::size_t>& views, int first, int count) {
  Eigen::MatrixXd basis(layout.size(), count);
  for (int i = 0; i < count; ++i) basis.col(i) = unitOf(layout, views, first + i);
  return basis;
}

void addCamera(const SetupLayout& layout, const std::vector<std::size_t>& views, const std::string& of,
               std::vector<SetupHypothesis>* all) {
  // One C-arm took all views: a camera that is wrong in one of them alone is less likely than the pose between them.
  const int extra = views.size() < layout.views() ? 6 : 0;
  all->push_back({"focal_length",
                  "the focal length" + of,
                  kCalibrate,
                  basisOf(layout, views, SetupLayout::kFocal, 1),
                  extra + 1,
                  true,
                  {{0, 1, "%", kPercent, ""}}});
  all->push_back({"principal_point",
                  "the principal point" + of,
                  kCalibrate,
                  basisOf(layout, views, SetupLayout::kCentre, 2),
                  extra + 2,
                  true,
                  {{0, 2, "px", 1.0, ""}}});
  all->push_back({"distortion",
                  "the radial distortion" + of,
                  kCalibrate,
                  basisOf(layout, views, SetupLayout::kRadial, 1),
                  extra + 1,
                  false,
                  {{0, 1, "%", kPercentAtRim, ""}}});
  all->push_back({"distortion",
                  "the S-shaped distortion" + of,
                  kCalibrate,
                  basisOf(layout, views, SetupLayout::kSwirl, 1),
                  extra + 1,
                  false,
                  {{0, 1, "%", kPercentAtRim, ""}}});
}

void addCtScale(const SetupLayout& layout, std::vector<SetupHypothesis>* all) {
  Eigen::MatrixXd axes = Eigen::MatrixXd::Zero(layout.size(), 3);
  axes.block<3, 3>(SetupLayout::kStrain, 0).setIdentity();
  const char* const remedy = "check its voxel spacing, and whether it is this patient's (another patient's CT?)";
  all->push_back(
      {"ct_scale", "the size of the CT", remedy, axes.rowwise().sum(), 1, true, {{0, 1, "%", kPercent, ""}}});
  all->push_back({"ct_scale",
                  "the size of the CT, by axis,",
                  remedy,
                  axes,
                  3,
                  true,
                  {{0, 1, "%", kPercent, "x"}, {1, 1, "%", kPercent, "y"}, {2, 1, "%", kPercent, "z"}}});
  Eigen::MatrixXd shape = Eigen::MatrixXd::Zero(layout.size(), 6);
  shape.block<6, 6>(SetupLayout::kStrain, 0).setIdentity();
  all->push_back({"other_patient",
                  "the shape of the CT (sizes and shear)",
                  "is it another patient's?",
                  shape,
                  7,
                  true,
                  {{0, 3, "%", kPercent, "size"}, {3, 3, "%", kPercent, "shear"}}});
}

}  // namespace

std::string inWords(const Amount& amount, const std::string& unit) {
  std::ostringstream text;
  text << std::setprecision(3) << amount.value << " ± " << std::setprecision(2) << amount.sigma << ' ' << unit;
  return text.str();
}

Amount amountOf(const SetupQuantity& quantity, const Eigen::VectorXd& parameters, const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd part = parameters.segment(quantity.first, quantity.count);
  const double length = part.norm();
  Eigen::VectorXd along = Eigen::VectorXd::Unit(quantity.count, 0);
  if (length > 0.0) along = part / length;
  const double variance =
      along.dot(covariance.block(quantity.first, quantity.first, quantity.count, quantity.count) * along);
  return {quantity.per_parameter * (quantity.count == 1 ? part[0] : length),
          quantity.per_parameter * std::sqrt(std::max(variance, 0.0))};
}

std::vector<SetupHypothesis> setupHypotheses(const SetupLayout& layout, const std::vector<std::string>& view_names) {
  std::vector<SetupHypothesis> all;
  std::vector<std::size_t> every;
  for (std::size_t view = 0; view < layout.views(); ++view) every.push_back(view);
  addCamera(layout, every, "", &all);
  for (std::size_t view = 0; view < layout.views() && layout.views() > 1; ++view) {
    const std::string of = " of the view '" + view_names[view] + "'";
    addCamera(layout, {view}, of, &all);
    if (view == 0) continue;
    all.push_back({"view_pose",
                   "the pose" + of,
                   kCalibrate,
                   basisOf(layout, {view}, SetupLayout::kViewPose, 6),
                   6,
                   true,
                   {{3, 3, "degrees", kDegreesPerRadian, "rotation"}, {0, 3, "mm", 1.0, "translation"}}});
  }
  addCtScale(layout, &all);
  return all;
}

}  // namespace xray_registration

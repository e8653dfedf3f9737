#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "registration/setup.h"

namespace xray_registration {

/// One number of a hypothesis as people state it: the length of a part of its parameters, or the one parameter itself.
struct SetupQuantity {
  int first = 0;  ///< Of the hypothesis's parameters.
  int count = 1;
  std::string unit;
  double per_parameter = 1.0;  ///< Unit per unit of the layout.
  std::string of;              ///< Which of several: "x axis of the CT"; empty when there is one.
};

/// A quantity of parameters with a covariance, in its unit: a length where it has several components, with the σ along
/// it.
struct Amount {
  double value = 0.0;
  double sigma = 0.0;
};
/// "1.02 ± 0.03 degrees"
std::string inWords(const Amount& amount, const std::string& unit);
Amount amountOf(const SetupQuantity& quantity, const Eigen::VectorXd& parameters, const Eigen::MatrixXd& covariance);

/// One thing that may have been told wrongly.
struct SetupHypothesis {
  std::string what;          ///< The interface's word, "view_pose".
  std::string in_words;      ///< "the pose of the view 'oblique'"
  std::string remedy;        ///< What to do about it, in words.
  Eigen::MatrixXd basis;     ///< Layout × parameters: what a unit of each of its parameters is in the layout.
  int complexity = 1;        ///< Less is more likely beforehand: parameters, and more for what only one view has.
  bool can_be_tried = true;  ///< The set-up can be moved by it, not only asked for its derivative.
  std::vector<SetupQuantity> quantities;
};

/// Everything that the views can be asked about: per view and, where a C-arm would do it, for all views alike.
/// `view_names`: empty strings where there are none.
std::vector<SetupHypothesis> setupHypotheses(const SetupLayout& layout, const std::vector<std::string>& view_names);

}  // namespace xray_registration

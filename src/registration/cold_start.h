#pragma once

#include <optional>
#include <vector>

#include "registration/frame_objective.h"

namespace xray_registration {

/// A solution from one search, and whether rays that the CT cannot explain were left out for it.
struct Attempt {
  Solution solution;
  bool leave_out = false;
};

/// The attempts of one cold start: which one is best, and whether another one found the same.
class Attempts {
 public:
  explicit Attempts(const Eigen::Vector3d& centre_ct) : centre_ct_(centre_ct) {}

  void add(const Attempt& attempt) { all_.push_back(attempt); }

  /// The most alike that did not fail; the first one when all failed.
  const Attempt& best() const;

  /// In-plane distance from the best to the nearest other one that did not fail, mm; a huge number without one.
  double disagreementMm() const;

 private:
  std::size_t bestIndex() const;

  Eigen::Vector3d centre_ct_;
  std::vector<Attempt> all_;
};

/// What a cold start gives.
struct ColdStartResult {
  Solution solution;
  ColdStart found;
  std::optional<double> disagreement_mm;  ///< Between two solves; none when the likeness alone is sure.
};

/// Finds the CT around a start that no accepted neighbour confirms: searches, descends coarse to fine, and, unless the
/// result is sure, does so again from other poses and on a finer level until the best result was found twice.
ColdStartResult startCold(FrameObjective* objective, const RigidTransform& start);

}  // namespace xray_registration

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

/// The best of what was found at another place than the best.
struct Rival {
  double similarity = -1.0;  ///< −1: nothing was.
  double distance_mm = 0.0;  ///< In-plane, from the best.
};

/// What speaks for the best attempt where likeness alone is not sure.
struct Confirmation {
  double disagreement_mm = 0.0;  ///< To the nearest other solve, in-plane.
  Rival rival;
};

/// How far from a start the CT can be; 0 bounds nothing.
struct Reach {
  RigidTransform T_camera_ct_start = RigidTransform::Identity();
  double rotation_rad = 0.0;
  double translation_mm = 0.0;
  bool holds(const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm) const;
};

/// The attempts of one cold start: which one is best, and whether another one found the same.
class Attempts {
 public:
  explicit Attempts(const Eigen::Vector3d& centre_ct, const Reach& reach = {}) : centre_ct_(centre_ct), reach_(reach) {}

  void add(const Attempt& attempt) { all_.push_back(attempt); }
  /// What a search found beside its best, down to the level above the finest.
  void addRival(const Attempt& attempt) { rivals_.push_back(attempt); }
  /// What found the best again, on the level above the finest: it never is the best itself.
  void addConfirmation(const Attempt& attempt) { confirmations_.push_back(attempt); }

  /// The most alike that did not fail; the first one when all failed.
  const Attempt& best() const;

  /// Did not fail, and is in reach.
  bool isUsable(const Attempt& attempt) const;

  /// In-plane distance from the best to an attempt, mm; a huge number when either failed.
  double distanceMm(const Attempt& attempt) const;

  /// In-plane distance from the best to the nearest other one that did not fail, mm; a huge number without one.
  double disagreementMm() const;

  /// The most alike of what was found elsewhere.
  Rival rival() const;

  /// The best of some: the most alike that did not fail and is in reach. Not empty.
  std::size_t bestOf(const std::vector<Attempt>& attempts) const;

 private:
  Eigen::Vector3d centre_ct_;
  Reach reach_;
  std::vector<Attempt> all_;
  std::vector<Attempt> rivals_;
  std::vector<Attempt> confirmations_;
};

/// What a cold start gives.
struct ColdStartResult {
  Solution solution;
  ColdStart found;
  std::optional<Confirmation> confirmation;  ///< None when the likeness alone is sure.
};

/// Finds the CT around a start that no accepted neighbour confirms: searches, descends coarse to fine, and, unless the
/// result is sure, does so again from other poses and on a finer level until the best result was found twice. Of
/// several starts the most alike is taken, and the others are its rivals. Not empty.
ColdStartResult startCold(FrameObjective* objective, const std::vector<RigidTransform>& starts);

}  // namespace xray_registration

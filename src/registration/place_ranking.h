#pragma once

#include <cstddef>
#include <vector>

#include "xray_registration/drr/engine.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/wide_search.h"

namespace xray_registration {

/// A pose in the first view's camera, and how much its DRRs resemble the small X-rays.
struct RankedPlace {
  RigidTransform T_camera_ct = RigidTransform::Identity();
  double score = -1.0;
};

/// Ranks poses of a wide range by DRRs in few pixels. A DRR of the CT in the middle of the range is compared at all
/// shifts at once: what shifts a DRR by a pixel is the CT that moves and turns with the ray to its centre, nearly. With
/// several views the scores of a place add.
class PlaceRanking {
 public:
  /// The engine has its CT and outlives this. @throws DeviceError.
  PlaceRanking(Engine* engine, const std::vector<ViewInput>& inputs, const WideSearchRange& range);

  /// Whether the CT is a small part of what the X-rays show: a bone among others has more look-alikes.
  bool isAmongOthers() const { return views_.front().target.detail_radius > 0; }
  std::size_t orientations() const { return orientations_.size(); }
  /// The next so many orientations; false when there are none left. @throws DeviceError.
  bool look(std::size_t count);
  double share() const { return static_cast<double>(looked_at_) / static_cast<double>(orientations_.size()); }
  double bestScore() const { return best_score_; }

  /// The best of all, best first.
  std::vector<RankedPlace> best(std::size_t count) const;

 private:
  struct View {
    RigidTransform T_view_first = RigidTransform::Identity();
    ShiftTarget target;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< Where the centre is seen without a shift.
    std::vector<double> depths_mm;                     ///< That DRRs are made at.
    int volume_level = 0;
    /// Index in an orientation's correlations.
    std::size_t indexOf(std::size_t depth, int column, int row) const;
    std::size_t perOrientation() const;
  };
  /// A place of the CT's centre, and where its correlations stand in each view's.
  struct Position {
    Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    std::vector<std::size_t> at;
  };

  View viewOf(const ViewInput& input, const std::vector<Eigen::Vector3d>& centres_mm) const;
  std::vector<Eigen::Vector3d> extremes(const ViewInput& first) const;
  void placePositions();
  bool locate(const Eigen::Vector3d& centre_mm, Position* position) const;
  std::vector<RigidTransform> posesOf(const View& view, std::size_t first, std::size_t count) const;
  void rank(std::size_t orientation, const std::vector<const float*>& correlations);
  RigidTransform poseAt(std::size_t orientation, const Position& position) const;

  Engine* engine_;
  WideSearchRange range_;
  std::vector<Eigen::Matrix3d> orientations_;
  std::vector<View> views_;
  std::vector<Position> positions_;
  std::vector<RankedPlace> ranked_;
  std::size_t looked_at_ = 0;
  double best_score_ = -1.0;
};

}  // namespace xray_registration

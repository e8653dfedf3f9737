#include "registration/place_ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "registration/orientations.h"
#include "xray_registration/image/image_pyramid.h"

namespace xray_registration {
namespace {

constexpr double kSpacingRad = 0.25;      // Between orientations: what refines from half of it is found.
constexpr double kBoneSpacingRad = 0.17;  // A bone among others has more look-alikes nearby.
constexpr double kDepthRatio = 1.12;      // Between depths: sizes that differ by less look alike.
constexpr double kShadowPixels = 24.0;    // Along what is seen of the CT,
constexpr double kBonePixels = 32.0;      // of a bone among others.
constexpr int kLargestSide = 64;
constexpr int kLargestReach = 40;
// A CT that covers less of the image's side is one body among others.
constexpr double kAmongOthers = 0.6;
constexpr int kDetailRadius = 3;
constexpr int kPlacesPerOrientation = 4;
constexpr double kOtherPlacePixels = 3.0;

/// Turns the optical axis onto a ray.
Eigen::Matrix3d alongRay(const Eigen::Vector3d& ray) {
  return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), ray).toRotationMatrix();
}

std::vector<double> depthsBetween(double nearest_mm, double farthest_mm) {
  const int steps =
      std::max(1, static_cast<int>(std::ceil(std::log(farthest_mm / nearest_mm) / std::log(kDepthRatio))));
  std::vector<double> depths;
  depths.reserve(static_cast<std::size_t>(steps));
  // Each stands for its part of the range.
  for (int i = 0; i < steps; ++i) depths.push_back(nearest_mm * std::pow(farthest_mm / nearest_mm, (i + 0.5) / steps));
  return depths;
}

/// The part of an image that pixels within `half` of `middle` are in; even an empty one has a pixel.
ShiftTarget cropped(const ShiftTarget& whole, const Eigen::Vector2d& middle, double half) {
  const int left = std::clamp(static_cast<int>(std::floor(middle.x() - half)), 0, whole.camera.width - 1);
  const int top = std::clamp(static_cast<int>(std::floor(middle.y() - half)), 0, whole.camera.height - 1);
  const int right = std::clamp(static_cast<int>(std::ceil(middle.x() + half)), left + 1, whole.camera.width);
  const int bottom = std::clamp(static_cast<int>(std::ceil(middle.y() + half)), top + 1, whole.camera.height);
  ShiftTarget part = whole;
  part.camera = whole.camera.cropped(left, top, right - left, bottom - top);
  part.attenuation = FloatImage(right - left, bottom - top);
  part.mask = MaskImage(right - left, bottom - top);
  for (int v = top; v < bottom; ++v) {
    for (int u = left; u < right; ++u) {
      part.attenuation.at(u - left, v - top) = whole.attenuation.at(u, v);
      part.mask.at(u - left, v - top) = whole.mask.at(u, v);
    }
  }
  return part;
}

ShiftTarget smallImage(const XrayFrame& xray, double pixel_mm, double depth_mm) {
  const int factor = std::max({1, static_cast<int>(pixel_mm / xray.camera.pixelSizeAt(depth_mm)),
                               std::max(xray.camera.width, xray.camera.height) / (4 * kLargestSide)});
  ShiftTarget target;
  target.camera = xray.camera.binned(factor);
  binImage(xray.attenuation, xray.mask, factor, &target.attenuation, &target.mask);
  if (target.mask.empty()) target.mask = MaskImage(target.camera.width, target.camera.height, 255);
  return target;
}

}  // namespace

std::size_t PlaceRanking::View::indexOf(std::size_t depth, int column, int row) const {
  const auto shifts = static_cast<std::size_t>(target.shifts());
  return (depth * shifts + static_cast<std::size_t>(row)) * shifts + static_cast<std::size_t>(column);
}

std::size_t PlaceRanking::View::perOrientation() const { return indexOf(depths_mm.size(), 0, 0); }

PlaceRanking::PlaceRanking(Engine* engine, const std::vector<ViewInput>& inputs, const WideSearchRange& range)
    : engine_(engine), range_(range) {
  const std::vector<Eigen::Vector3d> centres_mm = extremes(inputs.front());
  for (const ViewInput& input : inputs) views_.push_back(viewOf(input, centres_mm));
  const double spacing_rad = isAmongOthers() ? kBoneSpacingRad : kSpacingRad;
  orientations_ = range.T_camera_ct_centre
                      ? orientationsAround(range.T_camera_ct_centre->linear(), range.rotation_rad, spacing_rad)
                      : usualOrientations(spacing_rad);
  placePositions();
}

/// Corners of where the CT's centre may be.
std::vector<Eigen::Vector3d> PlaceRanking::extremes(const ViewInput& first) const {
  std::vector<Eigen::Vector3d> corners;
  const XrayCamera& camera = first.xray->camera;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign((i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0, (i & 4) != 0 ? 1.0 : -1.0);
    if (range_.T_camera_ct_centre) {
      corners.emplace_back(*range_.T_camera_ct_centre * engine_->volume().centreCt() + range_.translation_mm * sign);
    } else {
      const double u = sign.x() > 0.0 ? camera.width : 0.0;
      const double v = sign.y() > 0.0 ? camera.height : 0.0;
      corners.emplace_back(camera.rayDirection(u, v) * (sign.z() > 0.0 ? range_.farthest_mm : range_.nearest_mm));
    }
  }
  return corners;
}

PlaceRanking::View PlaceRanking::viewOf(const ViewInput& input, const std::vector<Eigen::Vector3d>& centres_mm) const {
  constexpr double kNearestMm = 50.0;  // From the source; nothing is seen there.
  View view;
  view.T_view_first = input.T_view_first;
  double nearest = std::numeric_limits<double>::max();
  double farthest = kNearestMm;
  for (const Eigen::Vector3d& centre_mm : centres_mm) {
    const double depth = std::max((input.T_view_first * centre_mm).z(), kNearestMm);
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  view.depths_mm = depthsBetween(nearest, std::max(farthest, 1.001 * nearest));
  const double depth_mm = std::sqrt(nearest * farthest);
  const XrayCamera& camera = input.xray->camera;
  const double field_mm = std::min(camera.width, camera.height) * camera.pixelSizeAt(depth_mm);
  const double size_mm = 2.0 * engine_->volume().radiusMm();
  const bool known = range_.T_camera_ct_centre.has_value();
  const bool among_others = size_mm < kAmongOthers * field_mm;
  view.target =
      smallImage(*input.xray, std::min(size_mm, field_mm) / (among_others ? kBonePixels : kShadowPixels), depth_mm);
  if (among_others) view.target.detail_radius = kDetailRadius;
  const XrayCamera whole = view.target.camera;
  view.middle = {0.5 * (whole.width - 1), 0.5 * (whole.height - 1)};
  double reach = 0.5 * std::max(whole.width, whole.height);
  if (known) {
    const Eigen::Vector3d centre_mm = input.T_view_first * *range_.T_camera_ct_centre * engine_->volume().centreCt();
    view.middle = whole.project({centre_mm.x(), centre_mm.y(), std::max(centre_mm.z(), kNearestMm)});
    reach = range_.translation_mm * 1.2 / whole.pixelSizeAt(depth_mm) + 1.0;
    const double half = reach + engine_->volume().radiusMm() / whole.pixelSizeAt(depth_mm);
    view.target = cropped(view.target, view.middle, std::min(half, static_cast<double>(kLargestSide)));
    view.middle -= Eigen::Vector2d(whole.cx - view.target.camera.cx, whole.cy - view.target.camera.cy);
  }
  view.target.reach = std::clamp(static_cast<int>(std::ceil(reach)), 1, kLargestReach);
  // Half as fine as the pixels: these hold means.
  view.volume_level = engine_->volume().levelFor(2.0 * view.target.camera.pixelSizeAt(depth_mm));
  return view;
}

/// All shifts and depths of the first view; with other views, in which depth is a shift, depths a pixel apart.
void PlaceRanking::placePositions() {
  const View& first = views_.front();
  const XrayCamera& camera = first.target.camera;
  std::vector<double> depths = first.depths_mm;
  if (views_.size() > 1) {
    const double low = first.depths_mm.front() / std::sqrt(kDepthRatio);
    const double high = first.depths_mm.back() * std::sqrt(kDepthRatio);
    const double step = camera.pixelSizeAt(0.5 * (low + high));
    depths.clear();
    for (double depth = low; depth <= high; depth += step) depths.push_back(depth);
  }
  const double limit = 1.1 * range_.translation_mm + camera.pixelSizeAt(depths.back());
  for (const double depth : depths) {
    for (int row = 0; row < first.target.shifts(); ++row) {
      for (int column = 0; column < first.target.shifts(); ++column) {
        const int reach = first.target.reach;
        const Eigen::Vector2d pixel = first.middle + Eigen::Vector2d(reach - column, reach - row);
        const Eigen::Vector3d centre_mm = camera.rayDirection(pixel.x(), pixel.y()) * depth;
        if (range_.T_camera_ct_centre &&
            (centre_mm - *range_.T_camera_ct_centre * engine_->volume().centreCt()).cwiseAbs().head<2>().maxCoeff() >
                limit) {
          continue;
        }
        Position position;
        position.centre_mm = centre_mm;
        position.pixel = pixel;
        if (locate(centre_mm, &position)) positions_.push_back(std::move(position));
      }
    }
  }
}

/// Where a centre's correlations are; false when one of the views did not look there.
bool PlaceRanking::locate(const Eigen::Vector3d& centre_mm, Position* position) const {
  for (const View& view : views_) {
    const Eigen::Vector3d seen_mm = view.T_view_first * centre_mm;
    if (!(seen_mm.z() > 1.0)) return false;
    const Eigen::Vector2d pixel = view.target.camera.project(seen_mm);
    const auto column = static_cast<int>(std::lround(view.target.reach - (pixel.x() - view.middle.x())));
    const auto row = static_cast<int>(std::lround(view.target.reach - (pixel.y() - view.middle.y())));
    if (std::min(column, row) < 0 || std::max(column, row) >= view.target.shifts()) return false;
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < view.depths_mm.size(); ++i) {
      if (std::abs(view.depths_mm[i] - seen_mm.z()) < std::abs(view.depths_mm[nearest] - seen_mm.z())) nearest = i;
    }
    position->at.push_back(view.indexOf(nearest, column, row));
  }
  return true;
}

std::vector<RigidTransform> PlaceRanking::posesOf(const View& view, std::size_t first, std::size_t count) const {
  const Eigen::Vector3d ray = view.target.camera.rayDirection(view.middle.x(), view.middle.y());
  std::vector<RigidTransform> poses;
  for (std::size_t i = first; i < first + count; ++i) {
    for (const double depth : view.depths_mm) {
      RigidTransform T = RigidTransform::Identity();
      T.linear() = view.T_view_first.linear() * orientations_[i];
      T.translation() = ray * depth - T.linear() * engine_->volume().centreCt();
      poses.push_back(T);
    }
  }
  return poses;
}

bool PlaceRanking::look(std::size_t count) {
  count = std::min(count, orientations_.size() - looked_at_);
  if (count == 0 || positions_.empty()) return false;
  std::vector<std::vector<float>> correlations;
  for (const View& view : views_) {
    correlations.push_back(engine_->matchShifts(view.target, view.volume_level, posesOf(view, looked_at_, count)));
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<const float*> of_views;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      of_views.push_back(correlations[v].data() + i * views_[v].perOrientation());
    }
    rank(looked_at_ + i, of_views);
  }
  looked_at_ += count;
  return looked_at_ < orientations_.size();
}

void PlaceRanking::rank(std::size_t orientation, const std::vector<const float*>& correlations) {
  std::vector<float> scores(positions_.size());
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    float sum = 0.0F;
    for (std::size_t v = 0; v < views_.size(); ++v) sum += correlations[v][positions_[i].at[v]];
    scores[i] = sum / static_cast<float>(views_.size());
  }
  std::vector<const Position*> taken;
  for (int place = 0; place < kPlacesPerOrientation; ++place) {
    std::size_t best = positions_.size();
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      if (best < positions_.size() && scores[i] <= scores[best]) continue;
      const bool is_known = std::any_of(taken.begin(), taken.end(), [&](const Position* other) {
        return (other->pixel - positions_[i].pixel).norm() < kOtherPlacePixels;
      });
      if (!is_known) best = i;
    }
    if (best == positions_.size()) return;
    taken.push_back(&positions_[best]);
    ranked_.push_back({poseAt(orientation, positions_[best]), scores[best]});
    best_score_ = std::max(best_score_, static_cast<double>(scores[best]));
  }
}

/// What looks like the DRR in the middle: turned with the ray to the centre.
RigidTransform PlaceRanking::poseAt(std::size_t orientation, const Position& position) const {
  const View& first = views_.front();
  const Eigen::Vector3d middle = first.target.camera.rayDirection(first.middle.x(), first.middle.y());
  RigidTransform T = RigidTransform::Identity();
  T.linear() = alongRay(position.centre_mm) * alongRay(middle).transpose() * orientations_[orientation];
  T.translation() = position.centre_mm - T.linear() * engine_->volume().centreCt();
  return T;
}

std::vector<RankedPlace> PlaceRanking::best(std::size_t count) const {
  std::vector<RankedPlace> sorted = ranked_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const RankedPlace& a, const RankedPlace& b) { return a.score > b.score; });
  sorted.resize(std::min(count, sorted.size()));
  return sorted;
}

}  // namespace xray_registration

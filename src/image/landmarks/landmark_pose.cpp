#include "xray_registration/image/landmark_pose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "image/landmarks/landmark_candidates.h"
#include "image/landmarks/landmark_checks.h"
#include "image/landmarks/landmark_refinement.h"

namespace xray_registration {
namespace {

constexpr int kRounds = 5;               // Of refining and of choosing who agrees.
constexpr double kSharePx = 0.01;        // Of the image's width.
constexpr double kLeastPx = 3.0;         // What a careful click is off.
constexpr double kLeastAgreeing = 0.6;   // Share of the points.
constexpr double kOtherPose_rad = 0.17;  // Poses farther apart are two.
// Noise makes one of two mirrored depths fit better; below this factor it is chance which.
constexpr double kAsGood = 1.5;
constexpr double kClick_px = 0.5;  // Nobody clicks better.
// By how much a mirror image must fit better, of many points and of few; and what is no misfit at all, of the limit.
constexpr double kMirrored = 1.5;
constexpr double kMirroredFew = 3.0;
constexpr double kNegligible = 0.02;

double inlierPx(const std::vector<LandmarkView>& views, const LandmarkOptions& options) {
  if (options.inlier_px > 0.0) return options.inlier_px;
  int width = 0;
  for (const LandmarkView& view : views) width = std::max(width, view.camera.width);
  return std::max(kLeastPx, kSharePx * width);
}

LandmarkPose judged(const std::vector<Landmark>& landmarks, const std::vector<LandmarkView>& views,
                    const RigidTransform& T_first_ct, double inlier_px) {
  LandmarkPose pose;
  pose.T_first_ct = T_first_ct;
  double sum = 0.0;
  for (const Landmark& landmark : landmarks) {
    const double residual = landmarkResidual(landmark, views, T_first_ct);
    pose.residual_px.push_back(residual);
    pose.used.push_back(residual <= inlier_px);
    if (pose.used.back()) sum += residual * residual;
  }
  pose.rms_px = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(pose.usedCount(), 1)));
  return pose;
}

/// Those that agree are refined together, until the same ones agree again.
LandmarkPose settled(const std::vector<Landmark>& landmarks, const std::vector<LandmarkView>& views,
                     const RigidTransform& candidate, double inlier_px) {
  // A candidate of three points is off for the others by several times what clicks are.
  LandmarkPose pose = judged(landmarks, views, candidate, 3.0 * inlier_px);
  for (int round = 0; round < kRounds && pose.usedCount() >= 4; ++round) {
    const LandmarkPose next =
        judged(landmarks, views, refinedPose(landmarks, pose.used, views, pose.T_first_ct), inlier_px);
    const bool is_settled = round > 0 && next.used == pose.used;
    pose = next;
    if (is_settled) break;
  }
  return judged(landmarks, views, pose.T_first_ct, inlier_px);
}

bool isBetter(const LandmarkPose& a, const LandmarkPose& b) {
  if (a.usedCount() != b.usedCount()) return a.usedCount() > b.usedCount();
  return a.rms_px < b.rms_px;
}

std::vector<LandmarkPose> settledCandidates(const std::vector<Landmark>& landmarks,
                                            const std::vector<LandmarkView>& views, double inlier_px) {
  std::vector<LandmarkPose> poses;
  for (const RigidTransform& candidate : landmarkCandidates(landmarks, views, inlier_px)) {
    if (!candidate.matrix().allFinite()) continue;
    poses.push_back(settled(landmarks, views, candidate, inlier_px));
  }
  std::stable_sort(poses.begin(), poses.end(), isBetter);
  return poses;
}

bool isEnough(const LandmarkPose& pose, std::size_t count) {
  return pose.usedCount() >= 4 && static_cast<double>(pose.usedCount()) >= kLeastAgreeing * static_cast<double>(count);
}

/// The best pose of the points' mirror image, which fits when left and right were exchanged somewhere.
std::optional<LandmarkPose> mirroredPose(std::vector<Landmark> landmarks, const std::vector<LandmarkView>& views,
                                         double inlier_px) {
  for (Landmark& landmark : landmarks) landmark.point_ct.x() = -landmark.point_ct.x();
  const auto poses = settledCandidates(landmarks, views, inlier_px);
  if (poses.empty() || !isEnough(poses.front(), landmarks.size())) return std::nullopt;
  return poses.front();
}

/// Whether the mirror image explains the pixels so much better that it is no chance. Only the beam's widening tells the
/// two apart, since a picture by parallel rays has no front and back: the wrong one may well be within the limit.
bool isBetterMirrored(const LandmarkPose& pose, const LandmarkPose& mirrored, double inlier_px) {
  if (mirrored.usedCount() != pose.usedCount()) return mirrored.usedCount() > pose.usedCount();
  // Four or five points leave little over beside the six numbers of a pose, and that little varies much.
  const double factor = pose.usedCount() >= 6 ? kMirrored : kMirroredFew;
  return pose.rms_px > kNegligible * inlier_px && pose.rms_px > factor * mirrored.rms_px;
}

std::string agreeingInWords(const std::vector<LandmarkPose>& poses, const std::vector<Landmark>& landmarks,
                            double inlier_px) {
  const std::size_t count = poses.empty() ? 0 : poses.front().usedCount();
  std::array<char, 32> limit{};
  std::snprintf(limit.data(), limit.size(), "%.1f px", inlier_px);
  return "only " + std::to_string(count) + " of " + std::to_string(landmarks.size()) + " points agree within " +
         limit.data();
}

}  // namespace

std::size_t LandmarkPose::usedCount() const {
  return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
}

LandmarkPose poseFromLandmarks(const std::vector<Landmark>& landmarks, const std::vector<LandmarkView>& views,
                               const LandmarkOptions& options) {
  checkLandmarks(landmarks, views);
  const double inlier_px = inlierPx(views, options);
  const auto poses = settledCandidates(landmarks, views, inlier_px);
  const bool is_enough = !poses.empty() && isEnough(poses.front(), landmarks.size());
  const auto mirrored = mirroredPose(landmarks, views, inlier_px);
  if (is_enough && mirrored && isBetterMirrored(poses.front(), *mirrored, inlier_px)) {
    throw LandmarkError(
        "the points fit much better as their mirror image: left and right are exchanged, in the points or in the "
        "image");
  }
  if (!is_enough) {
    const std::string agreeing = agreeingInWords(poses, landmarks, inlier_px);
    if (mirrored) {
      throw LandmarkError(agreeing +
                          ", but all do as their mirror image: left and right are exchanged, in the points or "
                          "in the image");
    }
    throw LandmarkError(agreeing + ": are they in the same order, is the camera right, are the points in LPS?");
  }
  const LandmarkPose& best = poses.front();
  std::vector<Eigen::Vector3d> agreeing;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (best.used[i]) agreeing.push_back(landmarks[i].point_ct);
  }
  if (areCollinear(agreeing)) throw LandmarkError("those points that agree lie on a line");
  for (const LandmarkPose& other : poses) {
    const bool is_other = rotationAngleBetween(best.T_first_ct, other.T_first_ct) > kOtherPose_rad;
    if (!is_other || other.usedCount() < best.usedCount()) continue;
    if (other.rms_px > kAsGood * std::max(best.rms_px, kClick_px)) continue;
    throw LandmarkError("two different poses fit the points alike: give more points, not all in one plane");
  }
  return best;
}

}  // namespace xray_registration

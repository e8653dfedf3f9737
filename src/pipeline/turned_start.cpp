#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "xray_registration/image/image_pyramid.h"
#include "xray_registration/pipeline/start_check.h"

namespace xray_registration {
namespace {

// Of 72 starts within 15 degrees and 25 mm in nine recorded views (head, pelvis, thorax, radius, ulna) a turn gained
// 0.22 at most; of 48 on head, pelvis and thorax that were turned 30 meet all three. What these do not tell apart is
// searched around as ever.
constexpr double kUnlike = 0.5;
constexpr double kAlike = 0.8;
constexpr double kGain = 0.35;

constexpr int kSize = 48;            // Of the image that is looked at, pixels, about.
constexpr double kReachMm = 30.0;    // What a start may be off in the image is left out of the comparison.
constexpr int kLargestReach = 10;    // Pixels.
constexpr int kStep = 2;             // Pixels between two shifts that are tried.
constexpr double kLeastShare = 0.2;  // Of the pixels, to be compared.

/// An X-ray in few pixels.
struct SmallXray {
  XrayCamera camera;
  FloatImage image;
  MaskImage mask;  ///< Empty: all may be used.
  int reach = 0;
};

SmallXray smallXray(const XrayFrame& xray, double depth_mm) {
  SmallXray small;
  const int factor = std::max(1, std::max(xray.camera.width, xray.camera.height) / kSize);
  small.camera = xray.camera.binned(factor);
  binImage(xray.attenuation, xray.mask, factor, &small.image, &small.mask);
  const double reach = kReachMm / small.camera.pixelSizeAt(std::max(depth_mm, 1.0));
  small.reach = std::clamp(static_cast<int>(std::lround(reach)), kStep, kLargestReach);
  return small;
}

/// Correlation with a DRR that is shifted by whole pixels.
double correlation(const SmallXray& xray, const FloatImage& drr, int shift_u, int shift_v) {
  double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  for (int v = std::max(0, shift_v); v < std::min(drr.height, drr.height + shift_v); ++v) {
    for (int u = std::max(0, shift_u); u < std::min(drr.width, drr.width + shift_u); ++u) {
      if (!xray.mask.empty() && xray.mask.at(u, v) == 0) continue;
      const double p = xray.image.at(u, v);
      const double q = drr.at(u - shift_u, v - shift_v);
      n += 1.0;
      a += p;
      b += q;
      aa += p * p;
      bb += q * q;
      ab += p * q;
    }
  }
  const double variance = (aa - a * a / n) * (bb - b * b / n);
  const bool enough = n >= kLeastShare * drr.width * drr.height && variance > 0.0;
  return enough ? (ab - a * b / n) / std::sqrt(variance) : -1.0;
}

double likeness(const SmallXray& xray, const FloatImage& drr) {
  double best = -1.0;
  if (drr.width != xray.image.width || drr.height != xray.image.height) return best;
  for (int v = -xray.reach; v <= xray.reach; v += kStep) {
    for (int u = -xray.reach; u <= xray.reach; u += kStep) best = std::max(best, correlation(xray, drr, u, v));
  }
  return best;
}

/// All that turn axes into axes, but for the one that turns nothing.
std::vector<Eigen::Matrix3d> turns() {
  std::vector<Eigen::Matrix3d> all;
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      if (x % 3 == y % 3) continue;
      Eigen::Matrix3d R;
      R.col(0) = Eigen::Vector3d::Unit(x % 3) * (x < 3 ? 1.0 : -1.0);
      R.col(1) = Eigen::Vector3d::Unit(y % 3) * (y < 3 ? 1.0 : -1.0);
      R.col(2) = R.col(0).cross(R.col(1));
      if (x != 0 || y != 1) all.push_back(R);
    }
  }
  return all;
}

RigidTransform turned(const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm,
                      const Eigen::Matrix3d& turn) {
  RigidTransform result;
  result.linear() = turn * T_camera_ct.linear();
  result.translation() = T_camera_ct * centre_ct_mm - result.linear() * centre_ct_mm;
  return result;
}

std::string inWords(const Eigen::Matrix3d& turn, double as_given, double best) {
  const Eigen::AngleAxisd angle_axis(turn);
  const Eigen::Vector3d& axis = angle_axis.axis();
  Eigen::Index largest = 0;
  const bool about_one = axis.cwiseAbs().maxCoeff(&largest) > 0.99;
  char about[64];
  if (about_one) {
    std::snprintf(about, sizeof about, "the camera's %c axis", "xyz"[largest]);
  } else {
    std::snprintf(about, sizeof about, "the camera's axis (%.0f, %.0f, %.0f)",
                  std::round(axis.x() / axis.cwiseAbs().maxCoeff()), std::round(axis.y() / axis.cwiseAbs().maxCoeff()),
                  std::round(axis.z() / axis.cwiseAbs().maxCoeff()));
  }
  const double sign = about_one && axis[largest] < 0.0 ? -1.0 : 1.0;
  char text[320];
  std::snprintf(
      text, sizeof text,
      "the start is wrong: turned by %.0f degrees about %s the CT would look like the X-ray (%.2f), and as given "
      "it does not (%.2f); give another start, or check the image source's flip and rotation settings",
      sign * angle_axis.angle() * 180.0 / M_PI, about, best, as_given);
  return text;
}

}  // namespace

std::string turnedStart(const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm, const ViewInput& view,
                        const DrrRenderer& render) {
  const SmallXray xray = smallXray(*view.xray, (T_camera_ct * centre_ct_mm).z());
  const double as_given = likeness(xray, render(xray.camera, T_camera_ct));
  if (as_given >= kUnlike) return "";
  double best = -1.0;
  Eigen::Matrix3d best_turn = Eigen::Matrix3d::Identity();
  for (const Eigen::Matrix3d& turn : turns()) {
    const double found = likeness(xray, render(xray.camera, turned(T_camera_ct, centre_ct_mm, turn)));
    if (found <= best) continue;
    best = found;
    best_turn = turn;
  }
  return best >= kAlike && best - as_given > kGain ? inWords(best_turn, as_given, best) : "";
}

}  // namespace xray_registration

#include "registration/discrete_hypotheses.h"

#include <algorithm>
#include <memory>
#include <numeric>
#include <utility>

namespace xray_registration {
namespace {

template <typename T>
Image<T> mirroredLeftRight(const Image<T>& image) {
  Image<T> mirrored = image;
  for (int v = 0; v < image.height; ++v) {
    const auto row = mirrored.pixels.begin() + static_cast<std::ptrdiff_t>(v) * image.width;
    std::reverse(row, row + image.width);
  }
  return mirrored;
}

template <typename T>
Image<T> turnedClockwise(const Image<T>& image) {
  Image<T> turned(image.height, image.width);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) turned.at(image.height - 1 - v, u) = image.at(u, v);
  }
  return turned;
}

template <typename Change>
void changeImages(const Change& change, XrayFrame* frame) {
  frame->attenuation = change(frame->attenuation.floats());
  if (!frame->mask.empty()) frame->mask = change(frame->mask);
}

void turn(int quarter_turns, XrayFrame* frame) {
  for (int i = 0; i < quarter_turns; ++i) {
    changeImages([](const auto& image) { return turnedClockwise(image); }, frame);
  }
}

void mirror(XrayFrame* frame) {
  changeImages([](const auto& image) { return mirroredLeftRight(image); }, frame);
}

/// The camera of the mirrored image, not of the image that was told mirrored.
void mirrorCamera(XrayCamera* camera) { camera->cx = camera->width - 1 - camera->cx; }

/// A motion seen in a mirror that exchanges left and right of both frames.
RigidTransform inMirror(const RigidTransform& motion) {
  const Eigen::DiagonalMatrix<double, 3> mirror(-1.0, 1.0, 1.0);
  RigidTransform mirrored = RigidTransform::Identity();
  mirrored.linear() = mirror * motion.linear() * mirror;
  mirrored.translation() = mirror * motion.translation();
  return mirrored;
}

/// The CT's centre where a mirrored image has it.
Eigen::Vector3d centreInMirror(const Eigen::Vector3d& centre_mm, const XrayCamera& camera) {
  const double u = camera.project(centre_mm).x();
  Eigen::Vector3d mirrored = centre_mm;
  mirrored.x() = (camera.width - 1 - u - camera.cx) / camera.fx * centre_mm.z();
  return mirrored;
}

/// Where the CT is, if an image that was mirrored left to right made it look as found; and the other way round.
RigidTransform otherSide(const RigidTransform& T_camera_ct_found, bool from_behind, const XrayCamera& camera,
                         const Eigen::Vector3d& centre_ct_mm) {
  const Eigen::DiagonalMatrix<double, 3> mirror(-1.0, 1.0, 1.0);
  const Eigen::DiagonalMatrix<double, 3> half_turn(-1.0, 1.0, -1.0);
  RigidTransform other = RigidTransform::Identity();
  if (from_behind) {
    other.linear() = half_turn * T_camera_ct_found.linear();
  } else {
    other.linear() = mirror * T_camera_ct_found.linear() * mirror;
  }
  other.translation() = centreInMirror(T_camera_ct_found * centre_ct_mm, camera) - other.linear() * centre_ct_mm;
  return other;
}

std::string ofView(const std::string& name) { return name.empty() ? "" : " of the view '" + name + "'"; }

const char* const kCheckImage = "check the image source's flip and rotation settings";

}  // namespace

std::array<RigidTransform, 2> otherSides(const RigidTransform& T_camera_ct, const XrayCamera& camera,
                                         const Eigen::Vector3d& centre_ct_mm) {
  return {otherSide(T_camera_ct, true, camera, centre_ct_mm), otherSide(T_camera_ct, false, camera, centre_ct_mm)};
}

void DiscreteHypotheses::add(const DiscreteHypothesis& hypothesis, const Change& change) {
  all_.push_back(hypothesis);
  changes_.push_back(change);
}

DiscreteHypotheses::DiscreteHypotheses(const std::vector<std::string>& view_names) {
  std::vector<std::vector<std::size_t>> groups(1, std::vector<std::size_t>(view_names.size()));
  std::iota(groups.front().begin(), groups.front().end(), 0);
  for (std::size_t view = 0; view < view_names.size() && view_names.size() > 1; ++view) groups.push_back({view});
  for (const std::vector<std::size_t>& views : groups) {
    const std::string xray = "the X-ray" + (views.size() == 1 ? ofView(view_names[views.front()]) : "");
    add({"mirrored_image", xray + " looks mirrored left to right", kCheckImage, true}, {Kind::kMirrored, 0, views});
    add({"mirrored_image", xray + " looks mirrored upside down", kCheckImage, true}, {Kind::kMirrored, 2, views});
    add({"turned_image", xray + " looks turned by 180 degrees", kCheckImage, true}, {Kind::kTurned, 2, views});
    add({"inverted_image", xray + " looks inverted", "check image/kind: dark and bright are exchanged", false},
        {Kind::kInverted, 0, views});
    if (views.size() != view_names.size()) continue;
    for (const Start start : {Start::kFromBehind, Start::kInMirror}) {
      add({"mirrored_image", xray + " looks mirrored, and the CT seen from its other side", kCheckImage, true},
          {Kind::kMirrored, 0, views, start});
    }
    add({"turned_image", xray + " looks turned by 90 degrees clockwise", kCheckImage, false},
        {Kind::kTurned, 3, views});
    add({"turned_image", xray + " looks turned by 90 degrees counterclockwise", kCheckImage, false},
        {Kind::kTurned, 1, views});
  }
  if (view_names.size() < 2) return;
  add({"mirrored_ct", "the CT looks mirrored", "check its orientation, left and right are exchanged", true},
      {Kind::kMirroredCt, 0, groups.front()});
  add({"exchanged_views", "the views '" + view_names[0] + "' and '" + view_names[1] + "' look exchanged",
       "check which image goes to which topic", false},
      {Kind::kExchanged, 0, {0, 1}});
}

PutRight DiscreteHypotheses::putRight(std::size_t index, const std::vector<ViewInput>& views,
                                      const RigidTransform& T_camera_ct_start, const RigidTransform& T_camera_ct_found,
                                      const Eigen::Vector3d& centre_ct_mm) const {
  const Change& change = changes_[index];
  PutRight right{views, T_camera_ct_start};
  if (change.start != Start::kAsTold) {
    right.T_camera_ct_start =
        otherSide(T_camera_ct_found, change.start == Start::kFromBehind, views.front().xray->camera, centre_ct_mm);
  }
  if (change.kind == Kind::kExchanged) {
    std::swap(right.views[0].xray, right.views[1].xray);
    return right;
  }
  for (const std::size_t view : change.views) {
    XrayFrame frame = *views[view].xray;
    if (change.kind == Kind::kInverted) {
      for (float& value : frame.attenuation.floats().pixels) value = -value;
    }
    turn(change.quarter_turns, &frame);
    if (change.kind == Kind::kMirrored || change.kind == Kind::kMirroredCt) mirror(&frame);
    if (change.kind == Kind::kMirroredCt) {
      mirrorCamera(&frame.camera);
      right.views[view].T_view_first = inMirror(views[view].T_view_first);
    }
    right.views[view].xray = std::make_shared<const XrayFrame>(std::move(frame));
  }
  if (change.kind == Kind::kMirroredCt) {
    // The right CT is M x with M the mirror at the plane x = centre; images in a mirror F show F T M x, and F T M is a
    // motion.
    RigidTransform about_centre = T_camera_ct_start * Eigen::Translation3d(centre_ct_mm);
    right.T_camera_ct_start = inMirror(about_centre) * Eigen::Translation3d(-centre_ct_mm);
  }
  return right;
}

}  // namespace xray_registration

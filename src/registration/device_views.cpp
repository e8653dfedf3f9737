#include "registration/device_views.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace xray_registration {
namespace {

/// How far beyond the CT's sphere a start may be off and its projection still be in the crop.
constexpr double kCropMarginMm = 15.0;
/// Line integral of unexplained tissue (5 cm of water) that halves a ray's weight.
constexpr double kUnexplainedLimit = 1.0;
/// Pixels of a whole image, in units of max_image_pixels, however small the CT's shadow in it is.
constexpr double kMostPixels = 50.0;
/// Pixels of CT shadow that a level needs: half a dozen tiles, or windows hold more of the rest than of the CT.
constexpr double kSmallestShadow = 400.0;

/// What the shadows of points cover, and `margin_mm` around it.
PixelBox shadowBox(const XrayCamera& camera, const std::vector<Eigen::Vector3d>& points_mm,
                   const RigidTransform& T_view_body, double margin_mm) {
  PixelBox box{std::numeric_limits<double>::max(), std::numeric_limits<double>::max(),
               std::numeric_limits<double>::lowest(), std::numeric_limits<double>::lowest()};
  for (const Eigen::Vector3d& point : points_mm) {
    const Eigen::Vector3d seen_mm = T_view_body * point;
    if (!(seen_mm.z() > 1.0)) return {};  // Beside or behind the source there is no shadow to bound.
    const Eigen::Vector2d pixel = camera.project(seen_mm);
    const Eigen::Vector2d margin = margin_mm / seen_mm.z() * Eigen::Vector2d(camera.fx, camera.fy);
    box.u_low = std::min(box.u_low, pixel.x() - margin.x());
    box.v_low = std::min(box.v_low, pixel.y() - margin.y());
    box.u_high = std::max(box.u_high, pixel.x() + margin.x() + 1.0);
    box.v_high = std::max(box.v_high, pixel.y() + margin.y() + 1.0);
  }
  return box;
}

}  // namespace

void DeviceViews::upload(const std::vector<ViewInput>& inputs, const RigidTransform& T_camera_ct_start,
                         double max_image_pixels, double reach_mm, int halvings) {
  views_.clear();
  surroundings_.clear();
  backdrop_ = nullptr;
  for (const ViewInput& input : inputs) {
    const RigidTransform T_view_ct = input.T_view_first * T_camera_ct_start;
    const PreparedView prepared = prepareView(*input.xray, boundsOf(T_view_ct, reach_mm),
                                              binningFor(input.xray->camera, T_view_ct, max_image_pixels) << halvings);
    views_.push_back({engine_->upload(prepared.camera, prepared.attenuation, prepared.weight), input.xray->camera,
                      input.T_view_first, twistCarriedBy(input.T_view_first)});
  }
}

void DeviceViews::shareFrom(const DeviceViews& other) {
  views_.clear();
  surroundings_.clear();
  backdrop_ = nullptr;
  for (const View& view : other.views_) {
    views_.push_back({engine_->share(view.xray.get()), view.told, view.T_view_first, view.twist_carried});
  }
}

ShadowBounds DeviceViews::boundsOf(const RigidTransform& T_view_ct, double reach_mm) const {
  ShadowBounds bounds{T_view_ct * centreCt(), engine_->volume().radiusMm() + kCropMarginMm, {}, 0.0};
  if (reach_mm < 0.0) return bounds;
  for (const Eigen::Vector3d& corner : engine_->volume().cornersCt()) bounds.corners_mm.push_back(T_view_ct * corner);
  bounds.margin_mm = reach_mm;
  return bounds;
}

std::vector<PixelBox> DeviceViews::shadowsIn(const View& view, const std::vector<BodyPlace>& bodies) const {
  std::vector<PixelBox> boxes;
  boxes.reserve(bodies.size());
  for (const BodyPlace& body : bodies) {
    boxes.push_back(
        shadowBox(view.level(0).camera, body.points_mm, view.T_view_first * body.T_camera_body, body.margin_mm));
  }
  return boxes;
}

void DeviceViews::limitTo(const std::vector<BodyPlace>& bodies) {
  for (View& view : views_) view.xray->limitTo(shadowsIn(view, bodies));
}

void DeviceViews::leaveOut(const std::vector<BodyPlace>& bodies) {
  for (View& view : views_) view.xray->leaveOut(shadowsIn(view, bodies));
}

void DeviceViews::surroundBy(std::vector<Surrounding> surroundings, DeviceViews* backdrop) {
  surroundings_ = std::move(surroundings);
  backdrop_ = backdrop;
  for (View& view : views_) view.xray->forgetSurroundings();
}

void DeviceViews::drawSurroundings(const View& view, int level) {
  if ((surroundings_.empty() && backdrop_ == nullptr) || view.xray->isSurrounded(level)) return;
  if (backdrop_ != nullptr) {
    const View& behind = backdrop_->views().at(static_cast<std::size_t>(&view - views_.data()));
    backdrop_->drawSurroundings(behind, level);
    engine_->surroundAs(view.xray.get(), level, behind.xray.get());
  }
  const XrayCamera& camera = view.level(level).camera;
  for (const Surrounding& other : surroundings_) {
    const RigidTransform T_view_body = view.T_view_first * other.T_camera_body;
    const double depth_mm = std::max((T_view_body * other.engine->volume().centreCt()).z(), 1.0);
    other.engine->surround(view.xray.get(), level, other.engine->volume().levelFor(camera.pixelSizeAt(depth_mm)),
                           T_view_body);
  }
}

void DeviceViews::setSaturation(double line_integral) {
  for (View& view : views_) view.xray->setSaturation(line_integral);
}

double DeviceViews::shadowPixels(const XrayCamera& camera, const RigidTransform& T_view_ct) {
  const FloatImage drr = engine_->render(camera, volumeLevel(camera, T_view_ct), T_view_ct);
  return static_cast<double>(
      std::count_if(drr.pixels.begin(), drr.pixels.end(), [](float value) { return value > 0.0F; }));
}

int DeviceViews::binningFor(const XrayCamera& whole, const RigidTransform& T_view_ct, double max_image_pixels) {
  const double pixels = static_cast<double>(whole.width) * whole.height;
  if (pixels <= max_image_pixels) return 1;
  // The march costs by the pixel that has CT behind it, so a small bone in a large image is seen finely.
  constexpr int kPreviewSide = 64;
  const int preview = std::max(1, std::min(whole.width, whole.height) / kPreviewSide);
  const double shadow = shadowPixels(whole.binned(preview), T_view_ct) * preview * preview;
  // Nor is there anything to see far below the voxels' size, or in an image that takes longer to bin than to register.
  const double finest_useful_mm = 0.3 * engine_->volume().levels().front().spacing_mm;
  const double factor =
      std::max({std::sqrt(shadow / max_image_pixels), std::sqrt(pixels / (kMostPixels * max_image_pixels)),
                finest_useful_mm / whole.pixelSizeAt(depthOf(T_view_ct))});
  return std::max(1, static_cast<int>(std::ceil(factor - 1e-9)));
}

bool DeviceViews::seesCentre(const RigidTransform& T_camera_ct) const {
  return std::any_of(views_.begin(), views_.end(), [&](const View& view) {
    const XrayCamera& camera = view.level(0).camera;
    const Eigen::Vector3d centre_mm = view.T_view_first * T_camera_ct * centreCt();
    if (!(centre_mm.z() > 0.0)) return false;
    const Eigen::Vector2d pixel = camera.project(centre_mm);
    return pixel.x() > -0.5 * camera.width && pixel.x() < 1.5 * camera.width && pixel.y() > -0.5 * camera.height &&
           pixel.y() < 1.5 * camera.height;
  });
}

int DeviceViews::lastLevel() const {
  int last = std::numeric_limits<int>::max();
  for (const View& view : views_) last = std::min(last, view.xray->lastLevel());
  return last;
}

int DeviceViews::coarsestLevel(const RigidTransform& T_camera_ct) {
  int coarsest = std::numeric_limits<int>::max();
  for (const View& view : views_) {
    int level = view.xray->lastLevel();
    double pixels = shadowPixels(view.level(level).camera, view.T_view_first * T_camera_ct);
    for (; level > 0 && pixels < kSmallestShadow; --level) pixels *= 4.0;
    coarsest = std::min(coarsest, level);
  }
  return coarsest;
}

bool DeviceViews::weigh(bool leave_out_unexplained, const RigidTransform& T_camera_ct) {
  constexpr double kNoticed = 0.98;
  bool noticed = false;
  for (View& view : views_) {
    if (leave_out_unexplained) {
      noticed |=
          engine_->weighUnexplained(view.xray.get(), view.T_view_first * T_camera_ct, kUnexplainedLimit) < kNoticed;
    } else {
      engine_->restoreWeights(view.xray.get());
    }
  }
  return noticed;
}

void DeviceViews::keepContrastTiles(double part) {
  for (View& view : views_) engine_->keepContrastTiles(view.xray.get(), 0, part);
}

void DeviceViews::useAllTiles() {
  for (View& view : views_) engine_->useAllTiles(view.xray.get());
}

double DeviceViews::depthOf(const RigidTransform& T_view_ct) const {
  return std::max((T_view_ct * centreCt()).z(), 1.0);
}

int DeviceViews::volumeLevel(const XrayCamera& camera, const RigidTransform& T_view_ct) const {
  return engine_->volume().levelFor(camera.pixelSizeAt(depthOf(T_view_ct)));
}

}  // namespace xray_registration

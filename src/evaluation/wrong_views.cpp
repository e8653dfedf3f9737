#include "evaluation/wrong_views.h"

#include <cmath>
#include <utility>

#include "evaluation/wrong_image.h"
#include "xray_registration/evaluation/random_starts.h"

namespace xray_registration {
namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

/// Calls `change(RawView*)` for the view of that name, for all where it is empty.
template <typename Change>
ChangeViews eachView(const std::string& name, const Change& change) {
  return [name, change](std::vector<RawView>* views) {
    Strings names;
    bool found = false;
    for (RawView& view : *views) {
      names.push_back("'" + view.name + "'");
      if (!name.empty() && view.name != name) continue;
      found = true;
      change(&view);
    }
    if (!found) refuse("there is no view '" + name + "'; views: " + joined(names));
  };
}

/// The same with `change(pixels) → pixels`.
template <typename Change>
ChangeViews eachImage(const std::string& name, const Change& change) {
  return eachView(name, [change](RawView* view) {
    if (view->image) view->image->pixels = change(floatsOf(view->image->pixels));
  });
}

/// What a further view's camera is off by, in its own axes about its own source.
RigidTransform viewOffset(const Strings& values) {
  const double angle_rad = number(values[0], "deg", -180.0, 180.0) * kRadPerDeg;
  const double distance_mm = number(values[1], "mm", -1e4, 1e4);
  Eigen::Vector3d about;
  Eigen::Vector3d along;
  if (values.size() == 4) {
    about = axisNamed(values[2]);
    along = axisNamed(values[3]);
  } else {
    RandomStarts random({1.0, 0.0}, seedAt(2, values));
    about = random.next().tail<3>().normalized();
    along = random.next().tail<3>().normalized();
  }
  RigidTransform offset = RigidTransform::Identity();
  offset.linear() = rotationFromVector(angle_rad * about);
  offset.translation() = distance_mm * along;
  return offset;
}

}  // namespace

ChangeViews focalLength(const Strings& values, const std::string& view) {
  const double factor = number(values[0], "", 0.5, 2.0);
  return eachView(view, [factor](RawView* changed) {
    changed->calibration.k[0] *= factor;
    changed->calibration.k[4] *= factor;
  });
}

ChangeViews principalPoint(const Strings& values, const std::string& view) {
  const double x_px = number(values[0], "px", -1e4, 1e4);
  const double y_px = number(values[1], "px", -1e4, 1e4);
  return eachView(view, [x_px, y_px](RawView* changed) {
    changed->calibration.k[2] += x_px;
    changed->calibration.k[5] += y_px;
  });
}

ChangeViews distortion(const Strings& values, const std::string& view) {
  if (values.size() == 2) {
    if (values[0] != "s_shape") refuse("'" + values[0] + "' is no shape");
    const double edge_px = number(values[1], "px", -1e3, 1e3);
    return eachImage(view, [edge_px](const FloatImage& image) { return sShaped(image, edge_px); });
  }
  const double k1 = number(values[0], "", -100.0, 100.0);
  return eachView(view, [k1](RawView* changed) {
    if (!changed->image) return;
    const FloatImage pixels = floatsOf(changed->image->pixels);
    changed->image->pixels =
        radiallyDistorted(pixels, cameraFromCalibration(changed->calibration, pixels.width, pixels.height), k1);
  });
}

ChangeViews viewPose(const Strings& values, const std::string& view) {
  const RigidTransform offset = viewOffset(values);
  return [offset, view](std::vector<RawView>* views) {
    if (views->size() < 2) refuse("there is no further view");
    // The first view's camera is the frame that the others are told in.
    if (view == views->front().name && !view.empty()) refuse("'" + view + "' is the first view, not a further one");
    const std::string further = view.empty() ? (*views)[1].name : view;
    eachView(further, [&offset](RawView* changed) { changed->T_view_first = offset * changed->T_view_first; })(views);
  };
}

ChangeViews mirroredImage(const Strings& values, const std::string& view) {
  if (values[0] == "left_right") return eachImage(view, mirroredLeftRight);
  if (values[0] == "up_down") return eachImage(view, mirroredUpDown);
  refuse("'" + values[0] + "' is no way to mirror an image");
}

ChangeViews turnedImage(const Strings& values, const std::string& view) {
  const double quarters = number(values[0], "deg", 90.0, 270.0) / 90.0;
  if (quarters != std::floor(quarters)) refuse("'" + values[0] + "' is no multiple of 90");
  return eachImage(view, [quarters](const FloatImage& image) { return turned(image, static_cast<int>(quarters)); });
}

ChangeViews invertedImage(const Strings&, const std::string& view) { return eachImage(view, inverted); }

ChangeViews exchangedViews(const Strings&, const std::string&) {
  return [](std::vector<RawView>* views) {
    if (views->size() < 2) refuse("there is no further view");
    std::swap((*views)[0].image, (*views)[1].image);
    std::swap((*views)[0].problem, (*views)[1].problem);
  };
}

}  // namespace xray_registration

#include "marker_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "xray_registration/pipeline/overlay.h"
#include "xray_registration/ros/surface_marker.h"

namespace xray_registration {
namespace {

constexpr double kMetres = 1e-3;
constexpr double kHand_mm = 100.0;
constexpr double kRoom = 1.3;        // Of the controls around the surface.
constexpr float kSeeThrough = 0.6F;  // So that it is told from ~ct_surface, which is where tf has the CT.
constexpr Rgb kMovedColour = {120, 190, 255};
constexpr double kBall_m = 0.008;
constexpr double kText_m = 0.014;

Rgb colourOf(const std::string& name, const std::vector<BodyParameters>& bodies) {
  const auto found =
      std::find_if(bodies.begin(), bodies.end(), [&](const BodyParameters& body) { return body.name == name; });
  return found == bodies.end() ? kMovedColour : bodyColour(static_cast<std::size_t>(found - bodies.begin()));
}

visualization_msgs::Marker surfaceOf(const ShownShape& shape, const Eigen::Vector3d& origin_mm, const Rgb& colour) {
  visualization_msgs::Marker marker = toMarker(*shape.mesh, "", "", colour);
  marker.header.frame_id.clear();  // The marker's own.
  marker.frame_locked = 0;
  marker.color.a = kSeeThrough;
  marker.pose.position.x = -origin_mm.x() * kMetres;
  marker.pose.position.y = -origin_mm.y() * kMetres;
  marker.pose.position.z = -origin_mm.z() * kMetres;
  return marker;
}

/// What stands for an object without a surface, to be taken hold of.
visualization_msgs::Marker ballInstead(double half_size_mm) {
  visualization_msgs::Marker ball;
  ball.type = visualization_msgs::Marker::SPHERE;
  ball.pose.orientation.w = 1.0;
  ball.scale.x = ball.scale.y = ball.scale.z = half_size_mm * kMetres;
  ball.color.r = static_cast<float>(kMovedColour[0]) / 255.0F;
  ball.color.g = static_cast<float>(kMovedColour[1]) / 255.0F;
  ball.color.b = static_cast<float>(kMovedColour[2]) / 255.0F;
  ball.color.a = kSeeThrough;
  return ball;
}

/// A control's axis is its own x.
visualization_msgs::InteractiveMarkerControl control(const std::string& name, std::uint8_t mode,
                                                     const Eigen::Vector3d& axis) {
  visualization_msgs::InteractiveMarkerControl result;
  result.name = name;
  result.interaction_mode = mode;
  const double half = std::sqrt(0.5);  // Of a quarter turn.
  result.orientation.w = half;
  result.orientation.x = half * axis.x();
  result.orientation.y = half * axis.y();
  result.orientation.z = half * axis.z();
  return result;
}

}  // namespace

double halfSizeOf(const ShownShape& shape) {
  if (shape.mesh->vertices_ct_mm.empty()) return kHand_mm;
  Eigen::Vector3f low = shape.mesh->vertices_ct_mm.front();
  Eigen::Vector3f high = low;
  for (const Eigen::Vector3f& vertex : shape.mesh->vertices_ct_mm) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  return 0.5 * static_cast<double>((high - low).maxCoeff());
}

visualization_msgs::InteractiveMarker movableMarker(const ShownShape& selected, const std::vector<ShownShape>& with,
                                                    const std::vector<BodyParameters>& bodies) {
  using Control = visualization_msgs::InteractiveMarkerControl;
  visualization_msgs::InteractiveMarker marker;
  marker.pose.orientation.w = 1.0;
  marker.scale = static_cast<float>(2.0 * kRoom * halfSizeOf(selected) * kMetres);
  Control surface;
  surface.name = "surface";
  surface.interaction_mode = Control::MENU;  // Dragging a surface by mistake would set a pose.
  surface.always_visible = 1;
  surface.orientation.w = 1.0;
  if (selected.mesh->triangles.empty()) {
    surface.markers.push_back(ballInstead(halfSizeOf(selected)));
  } else {
    surface.markers.push_back(surfaceOf(selected, selected.centre_mm, colourOf(selected.name, bodies)));
  }
  for (const ShownShape& shape : with) {
    if (shape.mesh->triangles.empty()) continue;
    surface.markers.push_back(surfaceOf(shape, selected.centre_mm, colourOf(shape.name, bodies)));
  }
  marker.controls.push_back(std::move(surface));
  const std::array<std::pair<const char*, Eigen::Vector3d>, 3> axes = {
      {{"x", Eigen::Vector3d::UnitX()}, {"z", Eigen::Vector3d::UnitY()}, {"y", Eigen::Vector3d::UnitZ()}}};
  for (const auto& [name, axis] : axes) {
    // A quarter turn about y takes x to -z, about z to y.
    marker.controls.push_back(control(std::string("move_") + name, Control::MOVE_AXIS, axis));
    marker.controls.push_back(control(std::string("rotate_") + name, Control::ROTATE_AXIS, axis));
  }
  return marker;
}

std::vector<visualization_msgs::Marker> landmarkMarkers(const std::vector<ShownLandmark>& landmarks,
                                                        const Eigen::Vector3d& origin_ct_mm) {
  const auto colour = [](ShownLandmark::State state, visualization_msgs::Marker* marker) {
    const bool red = state != ShownLandmark::State::kAgrees;
    const bool green = state != ShownLandmark::State::kLeftOut;
    const bool blue = state == ShownLandmark::State::kPaired;
    marker->color.r = red ? 1.0F : 0.1F;
    marker->color.g = green ? 1.0F : 0.1F;
    marker->color.b = blue ? 1.0F : 0.1F;
    marker->color.a = 1.0F;
  };
  std::vector<visualization_msgs::Marker> markers;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    visualization_msgs::Marker ball;
    ball.ns = "landmarks";
    ball.id = static_cast<int>(2 * i);
    ball.type = visualization_msgs::Marker::SPHERE;
    ball.pose.orientation.w = 1.0;
    const Eigen::Vector3d at = (landmarks[i].point_ct - origin_ct_mm) * kMetres;
    ball.pose.position.x = at.x();
    ball.pose.position.y = at.y();
    ball.pose.position.z = at.z();
    ball.scale.x = ball.scale.y = ball.scale.z = kBall_m;
    colour(landmarks[i].state, &ball);
    visualization_msgs::Marker number = ball;
    number.id = static_cast<int>(2 * i + 1);
    number.type = visualization_msgs::Marker::TEXT_VIEW_FACING;
    number.text = std::to_string(i + 1);
    number.scale.z = kText_m;
    number.pose.position.z += kText_m;
    markers.push_back(std::move(ball));
    markers.push_back(std::move(number));
  }
  return markers;
}

}  // namespace xray_registration

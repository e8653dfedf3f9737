#include "ct_marker.h"

#include <ros/console.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

using Event = visualization_msgs::InteractiveMarkerFeedback;

const char* const kName = "ct";
const char* const kLandmarks = "landmarks";
constexpr std::chrono::seconds kLeft{3};              // rviz gives a sign of life four times a second.
constexpr std::chrono::milliseconds kFollowing{200};  // Between two poses of a CT that is tracked.
constexpr double kTfTimeout_s = 0.2;
constexpr double kShadow = 0.75;  // Of the image: how much of it the CT covers where nothing is known.

std::vector<std::string> objectsOf(const NodeParameters& parameters) {
  std::vector<std::string> names;
  if (parameters.needsCt()) names.emplace_back();
  for (const BodyParameters& body : parameters.bodies) names.push_back(body.name);
  return names;
}

RigidTransform shiftBy(const Eigen::Vector3d& by) {
  RigidTransform shift = RigidTransform::Identity();
  shift.translation() = by;
  return shift;
}

/// Squared, mm.
double distanceTo(const TriangleMesh& mesh, const Eigen::Vector3d& point) {
  float nearest = std::numeric_limits<float>::max();
  const Eigen::Vector3f to = point.cast<float>();
  for (const Eigen::Vector3f& vertex : mesh.vertices_ct_mm) nearest = std::min(nearest, (vertex - to).squaredNorm());
  return nearest;
}

}  // namespace

CtMarker::CtMarker(const std::string& topic, const NodeParameters& parameters, const Transforms* transforms,
                   MarkerMenu::Actions menu, Actions actions)
    : parameters_(parameters),
      transforms_(transforms),
      actions_(std::move(actions)),
      menu_(objectsOf(parameters),
            [&] {
              menu.select = [this](const std::string& object) { actions_.post([this, object] { select(object); }); };
              menu.show = [this](const std::string& object) { actions_.post([this, object] { toggle(object); }); };
              return menu;
            }()),
      server_(std::make_unique<interactive_markers::InteractiveMarkerServer>(topic, "", true)) {}

const ShownShape* CtMarker::shapeNamed(const std::string& name) const {
  const auto found =
      std::find_if(shapes_.begin(), shapes_.end(), [&](const ShownShape& shape) { return shape.name == name; });
  return found == shapes_.end() ? nullptr : &*found;
}

const ShownShape* CtMarker::selectedShape() const { return shapeNamed(selected_); }

/// In the patient's directions as from the front, in the middle of the beam, so far away that it fills the image: where
/// nothing is known, somebody can take hold of it there.
RigidTransform CtMarker::standardPose(const ShownShape& shape) const {
  RigidTransform T = RigidTransform::Identity();
  T.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const double side_px = std::min(camera_->width, camera_->height);
  const double depth_mm = camera_->fx * 2.0 * halfSizeOf(shape) / (kShadow * side_px);
  const Eigen::Vector3d middle = camera_->rayDirection(0.5 * (camera_->width - 1), 0.5 * (camera_->height - 1));
  T.translation() = depth_mm * middle - T.linear() * shape.centre_mm;
  return T;
}

std::optional<RigidTransform> CtMarker::poseOf(const std::string& object) const {
  const auto known = T_camera_objects_.find(object);
  if (known != T_camera_objects_.end()) return known->second;
  const auto ct = T_camera_objects_.find("");
  if (ct != T_camera_objects_.end()) return ct->second;  // Bodies start where the CT has them.
  const ShownShape* shape = shapeNamed(object);
  if (shape == nullptr || !camera_) return std::nullopt;
  const ShownShape* whole = shapeNamed("");
  return standardPose(whole == nullptr ? *shape : *whole);
}

void CtMarker::takeShapes(std::vector<ShownShape> shapes) {
  endDrag();
  shapes_ = std::move(shapes);
  T_camera_objects_.clear();
  has_proposal_ = false;
  if (selectedShape() == nullptr && !shapes_.empty()) selected_ = shapes_.front().name;
  rebuild();
}

void CtMarker::forgetPoses() {
  endDrag();
  T_camera_objects_.clear();
  has_proposal_ = false;
  place();
}

void CtMarker::takeCamera(const std::string& camera_frame, const XrayCamera& camera) {
  const bool is_new = !camera_ || camera_frame != camera_frame_;
  camera_frame_ = camera_frame;
  camera_ = camera;
  // The X-ray that the preview lies over is another one.
  if (drag_ && drag_->moved && !due_) due_ = PreviewRequest{poseOf(selected_).value(), selected_, true};
  if (is_new) rebuild();
}

void CtMarker::takeResult(const RegistrationResult& result) {
  if (result.accepted && !has_proposal_ && !(drag_ && selected_.empty())) {
    T_camera_objects_[""] = result.T_camera_ct;
  }
  for (const BodyResult& body : result.bodies) {
    if (body.accepted && !(drag_ && selected_ == body.name)) T_camera_objects_[body.name] = body.T_camera_body;
  }
  if (!drag_ && Clock::now() - last_placed_ >= kFollowing) place();
}

void CtMarker::propose(const RigidTransform& T_camera_ct) {
  endDrag();
  T_camera_objects_[""] = T_camera_ct;
  has_proposal_ = true;
  due_ = PreviewRequest{T_camera_ct, "", false};
  if (selected_.empty()) return place();
  select("");
}

void CtMarker::withdraw() { has_proposal_ = false; }

void CtMarker::showLandmarks(const std::vector<ShownLandmark>& landmarks) {
  landmarks_ = landmarks;
  placeLandmarks();
}

void CtMarker::rebuild() {
  const ShownShape* shape = selectedShape();
  if (shape == nullptr || !camera_) {
    if (is_shown_) {
      server_->clear();
      server_->applyChanges();
    }
    is_shown_ = false;
    return;
  }
  std::vector<ShownShape> with;
  for (const ShownShape& other : shapes_) {
    const auto body = std::find_if(parameters_.bodies.begin(), parameters_.bodies.end(),
                                   [&](const BodyParameters& known) { return known.name == other.name; });
    const bool is_cut = body != parameters_.bodies.end() && body->isCutFromCt();
    if (selected_.empty() && is_cut && hidden_.count(other.name) == 0) with.push_back(other);
  }
  visualization_msgs::InteractiveMarker marker = movableMarker(*shape, with, parameters_.bodies);
  marker.name = kName;
  marker.description = selected_.empty() ? "CT" : selected_;
  marker.header.frame_id = camera_frame_;
  server_->insert(marker, [this](const visualization_msgs::InteractiveMarkerFeedbackConstPtr& feedback) {
    actions_.post([this, feedback] { take(*feedback); });
  });
  menu_.applyTo(server_.get(), kName);
  is_shown_ = true;
  place();
  placeLandmarks();
}

void CtMarker::place() {
  const ShownShape* shape = selectedShape();
  const std::optional<RigidTransform> T_camera_object = poseOf(selected_);
  if (!is_shown_ || shape == nullptr || !T_camera_object) return;
  last_placed_ = Clock::now();
  std_msgs::Header header;  // Without a stamp: rviz keeps it in this frame.
  header.frame_id = camera_frame_;
  server_->setPose(kName, toPose(RigidTransform(*T_camera_object * shiftBy(shape->centre_mm))), header);
  if (const ShownShape* ct = shapeNamed(""); ct != nullptr && !landmarks_.empty()) {
    server_->setPose(kLandmarks, toPose(RigidTransform(*poseOf("") * shiftBy(ct->centre_mm))), header);
  }
  server_->applyChanges();
}

void CtMarker::placeLandmarks() {
  const ShownShape* ct = shapeNamed("");
  if (!is_shown_ || ct == nullptr) return;
  if (landmarks_.empty()) {
    server_->erase(kLandmarks);
    return server_->applyChanges();
  }
  visualization_msgs::InteractiveMarker marker;
  marker.header.frame_id = camera_frame_;
  marker.name = kLandmarks;
  marker.pose = toPose(RigidTransform(*poseOf("") * shiftBy(ct->centre_mm)));
  marker.scale = 0.1F;
  visualization_msgs::InteractiveMarkerControl balls;
  balls.name = "balls";
  balls.always_visible = 1;
  balls.orientation.w = 1.0;
  balls.markers = landmarkMarkers(landmarks_, ct->centre_mm);
  marker.controls.push_back(std::move(balls));
  server_->insert(marker);
  server_->applyChanges();
}

void CtMarker::select(const std::string& object) {
  if (shapeNamed(object) == nullptr) {
    ROS_WARN_STREAM(
        "~ct_marker: " << (object.empty() ? "there is no CT around the bodies" : object + " is not loaded"));
    return;
  }
  endDrag();
  selected_ = object;
  menu_.mark(server_.get(), selected_, hidden_);
  rebuild();
}

void CtMarker::toggle(const std::string& object) {
  const bool is_shown = hidden_.erase(object) > 0;
  if (!is_shown) hidden_.insert(object);
  menu_.mark(server_.get(), selected_, hidden_);
  if (const ShownShape* shape = shapeNamed(object); shape != nullptr) {
    actions_.show_surface(object, is_shown ? *shape->mesh : TriangleMesh());
  }
  rebuild();
}

void CtMarker::take(const Feedback& feedback) {
  if (drag_) drag_->last_sign = Clock::now();
  if (feedback.event_type == Event::MOUSE_DOWN && feedback.control_name != "surface") {
    drag_ = Drag{Clock::now(), false};
    actions_.moved_by_hand(true);
  }
  if (feedback.event_type == Event::POSE_UPDATE) drag(feedback);
  if (feedback.event_type == Event::MOUSE_UP && drag_) letGo();
}

void CtMarker::drag(const Feedback& feedback) {
  const ShownShape* shape = selectedShape();
  if (shape == nullptr) return;
  if (!drag_) {
    drag_ = Drag{Clock::now(), false};
    actions_.moved_by_hand(true);
  }
  try {
    const std::string frame = tfFrame(feedback.header.frame_id);
    std::string why;
    const std::optional<RigidTransform> T_camera_frame =
        transforms_->lookup(camera_frame_, frame, ros::Time(), kTfTimeout_s, &why);
    if (!T_camera_frame) throw std::invalid_argument(why);
    const RigidTransform T_frame_marker = fromPose(feedback.pose, "the marker's pose");
    const RigidTransform T_camera_object(*T_camera_frame * T_frame_marker * shiftBy(-shape->centre_mm));
    T_camera_objects_[selected_] = T_camera_object;
    has_proposal_ = has_proposal_ && !selected_.empty();
    drag_->moved = true;
    due_ = PreviewRequest{T_camera_object, selected_, true};
  } catch (const std::invalid_argument& error) {
    ROS_WARN_STREAM_THROTTLE(1.0, "~ct_marker was moved to where nobody knows: " << error.what());
  }
}

void CtMarker::letGo() {
  const bool moved = drag_->moved;
  endDrag();
  if (!moved) return;
  const RigidTransform T_camera_object = poseOf(selected_).value();
  ROS_INFO_STREAM("~ct_marker: " << (selected_.empty() ? "the CT" : selected_)
                                 << " was moved by hand; the next registration starts there");
  for (const BodyParameters& body : parameters_.bodies) {
    if (selected_.empty() && body.isCutFromCt()) T_camera_objects_.erase(body.name);
  }
  actions_.set_pose(T_camera_object, camera_frame_, selected_);
  due_ = PreviewRequest{T_camera_object, selected_, false};
  place();
}

void CtMarker::endDrag() {
  if (!drag_) return;
  drag_.reset();
  due_.reset();
  actions_.moved_by_hand(false);
}

void CtMarker::tick() {
  if (drag_ && Clock::now() - drag_->last_sign > kLeft) {
    ROS_WARN("~ct_marker was taken hold of and never let go; nothing was set");
    endDrag();
  }
  if (due_ && actions_.preview(*due_)) due_.reset();
}

std::optional<Eigen::Vector3d> CtMarker::pointInCt(const geometry_msgs::PointStamped& point, std::string* why) const {
  constexpr double kMillimetres = 1e3;
  const Eigen::Vector3d p = Eigen::Vector3d(point.point.x, point.point.y, point.point.z) * kMillimetres;
  if (!p.allFinite()) {
    *why = "its numbers are not finite";
    return std::nullopt;
  }
  const std::string frame = tfFrame(point.header.frame_id);
  if (frame == parameters_.frames.ct) return p;
  std::vector<Eigen::Vector3d> places;
  if (const auto T_ct_frame = transforms_->lookup(parameters_.frames.ct, frame, ros::Time(), 0.0, why)) {
    places.emplace_back(*T_ct_frame * p);
  }
  const std::optional<RigidTransform> T_camera_ct = poseOf("");
  if (is_shown_ && T_camera_ct) {
    if (const auto T_camera_frame = transforms_->lookup(camera_frame_, frame, ros::Time(), kTfTimeout_s, why)) {
      places.emplace_back(T_camera_ct->inverse() * *T_camera_frame * p);
    }
  }
  if (places.empty()) return std::nullopt;
  const ShownShape* ct = shapeNamed("");
  if (ct == nullptr || places.size() == 1) return places.front();
  return distanceTo(*ct->mesh, places.back()) < distanceTo(*ct->mesh, places.front()) ? places.back() : places.front();
}

}  // namespace xray_registration

#pragma once

#include <geometry_msgs/PointStamped.h>
#include <interactive_markers/interactive_marker_server.h>

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "marker_menu.h"
#include "marker_shapes.h"
#include "xray_registration/ros/pose_preview.h"
#include "xray_registration/ros/result_listener.h"
#include "xray_registration/ros/transforms.h"

namespace xray_registration {

/// The interactive marker ~ct_marker: the CT, or the body that the menu selects, to be moved and turned in rviz. It
/// follows what is registered; while it is dragged, previews of where it is are asked for, and letting go sets the
/// pose. All methods belong to one thread; `post` brings the marker server's feedback there.
class CtMarker {
 public:
  struct Actions {
    std::function<void(std::function<void()>)> post;  ///< Runs something on this object's thread; from any thread.
    std::function<void(const RigidTransform& T_camera_object, const std::string& camera_frame, const std::string& body)>
        set_pose;
    std::function<bool(const PreviewRequest&)> preview;  ///< False: too soon, to be asked again.
    std::function<void(bool)> moved_by_hand;
    std::function<void(const std::string& body, const TriangleMesh&)> show_surface;  ///< An empty mesh hides it.
  };

  /// `topic`: the server's, resolved. `transforms` must outlive this.
  CtMarker(const std::string& topic, const NodeParameters& parameters, const Transforms* transforms,
           MarkerMenu::Actions menu, Actions actions);

  void takeShapes(std::vector<ShownShape> shapes);
  void takeCamera(const std::string& camera_frame, const XrayCamera& camera);
  void takeResult(const RegistrationResult& result);
  void forgetPoses();

  /// Shows where the CT would be; it stays there until `withdraw`, or until somebody moves it.
  void propose(const RigidTransform& T_camera_ct);
  void withdraw();

  /// What is shown beside the CT, and goes with it.
  void showLandmarks(const std::vector<ShownLandmark>& landmarks);

  /// A point that somebody has clicked, in the CT's coordinates, mm. It may lie on the CT where tf has it, or on the
  /// marker, whichever is nearer. Nothing, with the reason, when tf does not know the frame.
  std::optional<Eigen::Vector3d> pointInCt(const geometry_msgs::PointStamped& point, std::string* why) const;

  /// Where the marker has the CT, in the first view's camera; nothing before there is a marker.
  std::optional<RigidTransform> ctPose() const { return poseOf(""); }
  const std::string& cameraFrame() const { return camera_frame_; }

  /// To be called some thirty times a second: asks for previews, and ends what somebody has left.
  void tick();

 private:
  using Clock = std::chrono::steady_clock;
  using Feedback = visualization_msgs::InteractiveMarkerFeedback;

  void take(const Feedback& feedback);
  void drag(const Feedback& feedback);
  void letGo();
  void endDrag();
  void select(const std::string& object);
  void toggle(const std::string& object);
  void rebuild();
  void place();
  void placeLandmarks();
  const ShownShape* selectedShape() const;
  const ShownShape* shapeNamed(const std::string& name) const;
  std::optional<RigidTransform> poseOf(const std::string& object) const;
  RigidTransform standardPose(const ShownShape& shape) const;

  const NodeParameters& parameters_;
  const Transforms* transforms_;
  Actions actions_;
  MarkerMenu menu_;

  std::vector<ShownShape> shapes_;
  std::set<std::string> hidden_;
  std::string selected_;
  std::string camera_frame_;
  std::optional<XrayCamera> camera_;
  std::map<std::string, RigidTransform> T_camera_objects_;  ///< By name; the CT has none.
  std::vector<ShownLandmark> landmarks_;
  bool has_proposal_ = false;

  /// What somebody has hold of.
  struct Drag {
    Clock::time_point last_sign;
    bool moved = false;
  };
  std::optional<Drag> drag_;
  std::optional<PreviewRequest> due_;  ///< To be drawn next.
  bool is_shown_ = false;              ///< The server has the marker.
  Clock::time_point last_placed_;

  /// Last: its thread uses the rest.
  std::unique_ptr<interactive_markers::InteractiveMarkerServer> server_;
};

}  // namespace xray_registration

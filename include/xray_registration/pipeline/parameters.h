#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/common/escaped.h"
#include "xray_registration/common/log.h"
#include "xray_registration/image/mask.h"
#include "xray_registration/image/xray_frame.h"
#include "xray_registration/pipeline/body_parameters.h"
#include "xray_registration/pipeline/health.h"
#include "xray_registration/pipeline/recovery.h"
#include "xray_registration/pipeline/stamp_guard.h"
#include "xray_registration/registration/registrar_options.h"
#include "xray_registration/registration/tracker.h"
#include "xray_registration/volume/attenuation.h"
#include "xray_registration/volume/volume_io.h"

namespace YAML {
class Node;
}

namespace xray_registration {

/// A parameter that cannot be used; the message names it, its value, and what is allowed, on one line.
class ParameterError : public EscapedError {
 public:
  explicit ParameterError(const std::string& message) : EscapedError(onOneLine(message)) {}
};

enum class Mode {
  kTrack,     ///< Every frame is registered.
  kOnDemand,  ///< One frame is registered for each given pose and each ~register_once.
};

/// ct/…
struct CtParameters {
  std::string path;        ///< Empty: the node waits for ~load_ct; tools take theirs from --ct.
  VolumeReadOptions read;  ///< ct/series_uid, ct/directory
  AttenuationModel model;  ///< ct/water_attenuation (1/mm), ct/threshold_hu
  std::string mask;        ///< Label image; empty: the whole CT is registered.
  int label = 1;
  bool rest = true;  ///< With bodies or a label: the rest of the CT is in the picture and has its own pose.
  double surface_threshold_hu = 250.0;  ///< ~ct_surface: what counts as bone.
  int surface_triangles = 60000;        ///< ~ct_surface: at most so many; 0 makes none.
};

/// image/…
struct ImageParameters {
  LinearizeOptions linearize;                ///< image/kind, image/open_field
  MaskOptions find;                          ///< image/find_collimator, image/find_letters, image/find_metal
  double max_value = 0.0;                    ///< Largest value of the detector; 0 takes it from the encoding.
  std::string mask;                          ///< 8-bit image, non-zero = use; for all views.
  std::map<std::string, std::string> masks;  ///< image/masks/<view>: the same for one view.
  std::string undistortion_map;              ///< From `calibrate --grid`; for all views.
  std::map<std::string, std::string> undistortion_maps;  ///< image/undistortion_maps/<view>: the same for one view.
};

/// frames/…, publish_tf, invert_tf
struct FrameParameters {
  std::string ct = "ct";
  std::string fixed;  ///< Set: tf goes from here to the CT, and the camera's own motion is taken from tf.
  bool publish_tf = true;
  bool invert_tf = false;      ///< The CT becomes the parent.
  double tf_timeout_s = 0.05;  ///< How long a frame waits for its transforms.
  /// The first view's frame may be another one in mid-stream: then the CT gets another parent in tf.
  bool allow_change = false;
};

/// sync/…
struct SyncParameters {
  double tolerance_s = 0.02;        ///< Largest difference of stamps between the views of one frame.
  double patience_s = 0.25;         ///< How long a frame waits for a view or a CameraInfo, on the wall.
  bool allow_missing_view = false;  ///< Register with the views that are there.
};

/// localize/…: a wide search without any start.
struct LocalizeParameters {
  double nearest_mm = 450.0;       ///< From the first view's source to the CT's centre, at least,
  double farthest_mm = 1100.0;     ///< and at most.
  std::string centre_frame;        ///< Set: a frame of tf near the CT's centre says the distance instead,
  double centre_range_mm = 200.0;  ///< so much more or less.
};

/// clicks/…
struct ClickParameters {
  std::string point_topic = "clicked_point";  ///< Points of the CT, as rviz publishes them.
  std::string pixel_suffix = "_mouse_left";   ///< Of an image's topic: its pixels, as image viewers publish them.
};

/// Everything that node, register_bag and evaluate can be told; one YAML file serves all of them. Defaults are the
/// members' initial values.
struct NodeParameters {
  CtParameters ct;
  ImageParameters image;
  FrameParameters frames;
  SyncParameters sync;
  StampParameters stamps;
  HealthParameters health;
  LocalizeParameters localize;
  ClickParameters clicks;
  std::vector<std::string> views;  ///< Empty: one view, topics without a prefix.
  std::string device = "auto";
  RegistrarOptions registrar;         ///< method, accept/…, solver/…, paper/…
  TrackerOptions tracker;             ///< tracking/…
  Recover recover = Recover::kLocal;  ///< tracking/recover
  int calibration_frames =
      12;  ///< calibration/frames: kept for ~calibrate, those whose poses differ the most; 0: none.
  Mode mode = Mode::kTrack;
  std::optional<RigidTransform> initial_pose;  ///< T_camera_ct of the first view, mm.
  std::string initial_pose_frame;              ///< Frame of initial_pose; empty: the first view's optical frame.
  std::vector<BodyParameters> bodies;          ///< Structures with a pose of their own.
  std::string drr_encoding = "mono8";
  std::string image_transport = "raw";

  /// Whether something is to be registered that only ct/path has: without bodies, or with one that is cut out of it.
  bool needsCt() const;

  /// Names to go with the views' order; one empty name when there are no views.
  std::vector<std::string> viewNames() const { return views.empty() ? std::vector<std::string>{""} : views; }
};

/// Reads a parsed YAML tree.
/// @throws ParameterError for a wrong type, a value out of range, or an unknown name below a known group; an unknown
/// name beside the groups is only warned of, since other libraries keep their parameters there too.
NodeParameters parseParameters(const YAML::Node& tree, const Logger& logger = {});

/// The same from a YAML file.
/// @throws ParameterError also when the file cannot be read.
NodeParameters loadParametersYaml(const std::string& path, const Logger& logger = {});

/// Checks everything that loading checks; for parameters that were changed in code or live.
/// @throws ParameterError
void validate(const NodeParameters& parameters);

}  // namespace xray_registration

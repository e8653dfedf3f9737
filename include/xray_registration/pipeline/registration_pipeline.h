#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "xray_registration/pipeline/device_host.h"
#include "xray_registration/pipeline/drr_parts.h"
#include "xray_registration/pipeline/frame_maker.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/pipeline/registered_body.h"
#include "xray_registration/registration/wide_search.h"
#include "xray_registration/volume/volume.h"

namespace xray_registration {

class Engine;
struct PipelineSearch;

/// A body that is followed, as configured and as it is on the device.
struct FollowedBodyInfo {
  std::string name;
  bool cut_from_ct = false;  ///< Moves in the CT, whose frame it has; otherwise it has a frame of its own.
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
};

/// What a body looks like.
struct BodyShape {
  std::string name;  ///< Empty: the CT around the bodies.
  std::shared_ptr<const AttenuationVolume> volume;
  double surface_per_mm = 0.0;  ///< Attenuation at its surface.
};

/// What became of a frame.
struct FrameOutcome {
  RegistrationResult result;  ///< Always has a reason when it is not accepted, and so has each of its bodies, which
                              ///< are always those of followedBodies().
  /// The solver ran and gave a pose. Otherwise the frame was refused before (no CT, no pose, a view that is missing, a
  /// start that the method cannot use) or the device failed, and of the result only the reason means anything.
  bool registered = false;
  TrackingState state = TrackingState::kWaitingForCt;
  std::vector<std::string> views_used;
  std::vector<std::string> views_missing;
  std::string missing_because;  ///< What is wrong with the missing views.
  /// What the solver was given, in the order of the views (empty where one is missing); for overlays.
  std::vector<std::optional<ViewInput>> views;
  double prepare_ms = 0.0;  ///< Linearising, undistorting and masking all views.
  double total_ms = 0.0;    ///< From the images in memory to the verdict: preparation, upload, solve.
};

/// The way of one frame from pixels to a verdict, the same in the node, register_bag and evaluate: a device, a maker of
/// frames, and the body that is followed. Needs no ROS master and no clock. Not thread-safe: one worker owns it.
class RegistrationPipeline {
 public:
  using RegistrarFactory = DeviceHost::RegistrarFactory;

  /// Reads the masks that the parameters name; opens no device yet.
  /// @throws ParameterError when a mask cannot be read.
  explicit RegistrationPipeline(const NodeParameters& parameters, const Logger& logger = {});
  /// The same with another source of registrars than the device that the parameters name.
  RegistrationPipeline(const NodeParameters& parameters, RegistrarFactory factory, const Logger& logger);

  ~RegistrationPipeline();

  /// Opens the device and warms it up. loadCt does so too when nobody did. A failure is kept as the fault.
  /// @throws DeviceError
  void openDevice() { device_.open(); }

  /// Reads a CT (and ct/mask) and puts it on the device. Forgets the pose. What cannot be read leaves the previous CT
  /// and its pose as they were; what cannot be put on the device is the fault, and no CT is registered until one can.
  /// @throws VolumeError, DeviceError; the latter is the fault.
  void loadCt(const std::string& path, const std::string& series_uid = "");
  /// The same with a CT at hand, which is kept for the bone surface.
  void setCt(Volume ct);

  /// Reads the bodies that have CTs or meshes of their own and puts them on the device, when the parameters need no CT
  /// (NodeParameters::needsCt); the first one then stands for the CT. Otherwise the CT brings them with it.
  /// @throws VolumeError, DeviceError as loadCt does.
  void loadBodies();

  /// Starts of bodies by name, in the first view's camera frame.
  using BodyPoses = std::map<std::string, RigidTransform>;

  /// A start in the first view's camera frame; replaces all history, so the next frame is a cold start. Bodies start
  /// where the CT has them, or where they are configured to.
  void setPose(const RigidTransform& T_camera_ct) { setPose(T_camera_ct, {}); }
  /// The same with starts of their own for some bodies.
  void setPose(const RigidTransform& T_camera_ct, const BodyPoses& T_camera_bodies);
  /// A start of one body alone, in the first view's camera frame; the others go on. False, with nothing done, when
  /// there is no body of that name, or when it is cut out of the CT and where that is, is not known yet.
  bool setBodyPose(const std::string& body, const RigidTransform& T_camera_body, double stamp_s);
  /// Forgets the pose, but for that of bodies that are configured to start somewhere. A fault is forgotten too: the
  /// device is opened anew by the next frame.
  void reset();

  /// Registers one frame. Views come in the order of the parameter `views`; moved in, their pixels are not copied.
  /// Never throws on what a frame, the device or a pose may do: the outcome says why nothing was found. A device that
  /// fails is rebuilt once, and the next frame is a cold start from the last pose; if that does not help, the state is
  /// FAULT until reset, loadCt or a new process.
  /// @param T_camera_now_camera_last  The camera's own motion since lastAcceptedStamp(), when it is known.
  FrameOutcome process(double stamp_s, std::vector<RawView> views,
                       const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt);

  /// Begins a wide search for the CT in one frame, in place of one that goes on; the start and the history stay as they
  /// are. Why that cannot be, in words; empty: it has begun. It ends with the CT, with other tuning, and when the
  /// device fails.
  std::string beginSearch(double stamp_s, std::vector<RawView> views, const WideSearchRange& range);
  /// Does one slice of it, some tens of milliseconds. False when nothing is left to do, or nothing was begun.
  bool advanceSearch();
  double searchProgress() const;        ///< 0 … 1
  double searchBestSimilarity() const;  ///< −1 … 1
  /// Registers the frame of the search from what it found, judged as any cold start. When that is accepted, tracking
  /// goes on from there; otherwise, and when `is_wanted` says then that nobody waits for it any more, start and history
  /// are what they were. Ends the search.
  FrameOutcome finishSearch(const std::function<bool()>& is_wanted = {});
  void dropSearch();

  /// What process() would look at, for who only shows it.
  FrameViews prepare(std::vector<RawView> views) { return frame_maker_.make(std::move(views)); }

  /// A frame that could not be used and never came to process() counts as a refused one, as one does there.
  void noteUnusable();
  /// Nothing was seen for too long: what is tracked is lost, and the next frame is a cold start from the last pose.
  void loseTrack();

  /// DRR of the present CT in line integrals. Empty, with the fault set, when the device fails; empty without a CT.
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct);
  /// The same of a frame's result with the bodies where they were found, accepted or not, as one of its views sees it.
  DrrParts renderParts(const ViewInput& view, const RegistrationResult& result);

  /// What is followed, for pictures of it: the CT (without a name, without its bodies) where none of the list stands
  /// for it, and each body.
  std::vector<BodyShape> shapes() const;

  /// Takes new thresholds and tuning while running (not the method, the views, or the device).
  void setTuning(const RegistrarOptions& registrar, const TrackerOptions& tracker);

  TrackingState state() const;
  /// Why the state is FAULT; empty otherwise.
  const std::string& fault() const { return device_.fault(); }
  bool hasCt() const { return body_.attenuation != nullptr; }
  const std::string& ctName() const { return body_.name; }
  /// Start of the next registration, if there is one.
  std::optional<RigidTransform> prediction(double stamp_s) const { return body_.tracker.prediction(stamp_s); }
  /// Whether the next frame can be registered: of the CT or of a body that is registered by itself a start is known.
  bool hasStart(double stamp_s) const;
  /// Stamp of the last accepted frame since the pose was set; what `T_camera_now_camera_last` refers to.
  std::optional<double> lastAcceptedStamp() const { return body_.last_accepted_s; }
  Eigen::Vector3d centreCt() const { return body_.centre_ct_mm; }
  /// Where the voxels of the present CT lie; nothing without one.
  std::optional<VolumeGrid> ctGrid() const;
  /// The bodies of the list `bodies`, once they are loaded; the order is that of the results.
  std::vector<FollowedBodyInfo> followedBodies() const;
  const std::string& deviceName() const { return device_.deviceName(); }
  /// The engine of the fast method with the present CT on it, for who asks more than poses of it. Null without a CT or
  /// with another method; gone with the next CT, tuning, or failure of the device.
  Engine* engine();
  /// For who was given engine(): the device failed. It is opened anew, once, and the next frame is a cold start from
  /// the last pose; false, with the fault set, when that was done before without a success since, or does not help.
  bool rebuildAfter(const std::string& failure);
  std::size_t deviceBytes() const { return body_.registrar ? body_.registrar->deviceBytes() : 0; }
  const NodeParameters& parameters() const { return parameters_; }
  /// The CT as it was read, until the next one is read or dropCt() is called; for the bone surface.
  std::shared_ptr<const Volume> ct() const { return ct_; }
  void dropCt() { ct_.reset(); }

 private:
  RegistrationPipeline(NodeParameters parameters, DeviceHost device, Logger logger);
  void complete(double stamp_s, const std::optional<RigidTransform>& T_camera_now_camera_last,
                const std::vector<RigidTransform>& places, FrameOutcome* outcome);
  std::string viewsProblem(std::vector<RawView> views, FrameOutcome* outcome);
  std::string reasonToRefuse(double stamp_s, std::vector<RawView> views, FrameOutcome* outcome);
  std::string startProblem(double stamp_s, const FrameOutcome& frame);
  void upload(std::vector<RegisteredBody> own);
  void closeOwn();
  void refuseBodies(const std::string& reason, RegistrationResult* result) const;
  void refuseOwn(RegistrationResult* result) const;
  void startConfigured();
  std::optional<RigidTransform> configuredStartOf(const std::string& body) const;
  Registrar* registrarOf(const std::string& body);
  DrrParts renderAll(const ViewInput& view, const RegistrationResult& result);
  void renderCut(const ViewInput& view, const RegistrationResult& result, DrrParts* parts);
  /// The camera's own, since a frame that lastAcceptedStamp() names.
  struct CameraMotion {
    std::optional<double> since_s;
    std::optional<RigidTransform> T_camera_now_camera_last;
  };
  void solveOwn(double stamp_s, const std::vector<std::optional<ViewInput>>& views, const CameraMotion& moved,
                RegistrationResult* result);
  BodyResult solveOwn(double stamp_s, const std::vector<std::optional<ViewInput>>& views, const CameraMotion& moved,
                      RegisteredBody* body);
  RegistrationResult solve(double stamp_s, const FrameOutcome& frame,
                           const std::optional<RigidTransform>& T_camera_now_camera_last,
                           const std::vector<RigidTransform>& places);
  std::string startSearch(double stamp_s, FrameOutcome frame, const WideSearchRange& range);
  bool registerOrRecover(double stamp_s, const std::optional<RigidTransform>& T_camera_now_camera_last,
                         FrameOutcome* outcome);
  bool registerWhatIsFound(double stamp_s, const std::optional<RigidTransform>& T_camera_now_camera_last,
                           FrameOutcome* outcome);

  NodeParameters parameters_;
  Logger logger_;
  FrameMaker frame_maker_;
  DeviceHost device_;
  RegisteredBody body_;              ///< After device_: its registrar goes first.
  std::vector<RegisteredBody> own_;  ///< Bodies that are registered by themselves, beside body_.
  bool first_is_body_ = false;       ///< body_ is the first body of the list, not the CT around them.
  std::shared_ptr<const Volume> ct_;
  Recovery recovery_;
  std::unique_ptr<PipelineSearch> search_;  ///< After body_: it stands on its registrar.
};

}  // namespace xray_registration

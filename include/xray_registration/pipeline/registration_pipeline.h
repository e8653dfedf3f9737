#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/image/raw_image.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/tracker.h"

namespace xray_registration {

class Device;

/// One view of a frame as it came in: either pixels with their calibration, or why there are none.
struct RawView {
  std::string name;  ///< As in the parameter `views`; empty for a single view.
  std::optional<RawImage> image;
  Calibration calibration;
  RigidTransform T_view_first = RigidTransform::Identity();  ///< Points of the first view's camera into this one's.
  std::string problem;                                       ///< Why `image` is empty, in words.
};

/// A frame's views, ready for the registrar.
struct PreparedFrame {
  std::vector<std::optional<ViewInput>> views;  ///< In the order of the parameter `views`; empty where one is missing.
  std::string problem;                          ///< Why views are missing, in words; empty when all are there.
  double prepare_ms = 0.0;                      ///< Linearising, undistorting and masking all views.
};

/// What became of a frame.
struct FrameOutcome {
  RegistrationResult result;  ///< Always has a reason when it is not accepted.
  bool registered = false;    ///< Whether the solver ran at all; otherwise result.T_camera_ct means nothing.
  TrackingState state = TrackingState::kWaitingForCt;
  std::vector<std::string> views_used;
  std::vector<std::string> views_missing;
  /// What the solver was given, in the order of the views (empty where one is missing); for overlays.
  std::vector<std::optional<ViewInput>> views;
  double prepare_ms = 0.0;  ///< Linearising, undistorting and masking all views.
  double total_ms = 0.0;    ///< The time that this frame took, its preparation included.
};

/// The way of one frame from pixels to a verdict, the same in the node, register_bag and evaluate: owns the device, the
/// registrar with its CT, and the tracker. Needs no ROS master and no clock. Not thread-safe: one worker owns it.
class RegistrationPipeline {
 public:
  /// Makes the registrar; called at the start and when the device has to be rebuilt.
  using RegistrarFactory = std::function<std::unique_ptr<Registrar>(const RegistrarOptions& options)>;

  /// Reads the masks that the parameters name; opens no device yet.
  /// @throws ParameterError when a mask cannot be read.
  explicit RegistrationPipeline(NodeParameters parameters, Logger logger = {});

  /// The same with another source of registrars than the device that the parameters name.
  RegistrationPipeline(NodeParameters parameters, RegistrarFactory factory, Logger logger);
  ~RegistrationPipeline();

  /// Opens the device and warms it up. loadCt does so too when nobody did. A failure is kept as the fault.
  /// @throws DeviceError
  void openDevice();

  /// Reads a CT (and ct/mask) and puts it on the device. Forgets the pose. The previous CT stays when reading fails.
  /// @throws VolumeError, DeviceError; the latter also becomes the fault.
  void loadCt(const std::string& path, const std::string& series_uid = "");
  /// The same with a CT at hand (phantoms).
  void setCt(const Volume& ct);

  /// A start in the first view's camera frame; replaces all history.
  void setPose(const RigidTransform& T_camera_ct);
  /// Forgets the pose. A fault is forgotten too: the device is opened anew by the next frame.
  void reset();

  /// Linearises, undistorts and masks one view.
  /// @throws FrameError
  ViewInput makeView(const RawView& raw) const;

  /// Makes all views of a frame; what is wrong with one is said in the result.
  PreparedFrame prepare(const std::vector<RawView>& views) const;

  /// Registers one frame. Views come in the order of the parameter `views`. Never throws on what a frame, the device or
  /// a pose may do: the outcome says why nothing was found. A device that fails is rebuilt once; if that does not help,
  /// the state is FAULT until reset, loadCt or a new process.
  FrameOutcome process(double stamp_s, const std::vector<RawView>& views,
                       const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt);
  /// The same with a frame that was prepared before.
  FrameOutcome process(double stamp_s, PreparedFrame frame,
                       const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt);
  /// The same with views that were made before.
  FrameOutcome process(double stamp_s, const std::vector<std::optional<ViewInput>>& views,
                       const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt);

  /// DRR of the present CT in line integrals. Empty, with the fault set, when the device fails; empty without a CT.
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct);

  /// Takes new thresholds and tuning while running (not the method, the views, or the device).
  void setTuning(const RegistrarOptions& registrar, const TrackerOptions& tracker);

  TrackingState state() const;
  /// Why the state is FAULT; empty otherwise.
  const std::string& fault() const { return fault_; }
  bool hasCt() const { return attenuation_ != nullptr; }
  const std::string& ctName() const { return ct_name_; }
  /// Start of the next registration, if there is one.
  std::optional<RigidTransform> prediction(double stamp_s) const { return tracker_.prediction(stamp_s); }
  /// Stamp of the last accepted frame since the pose was set; what `T_camera_now_camera_last` refers to.
  std::optional<double> lastAcceptedStamp() const { return last_accepted_s_; }
  Eigen::Vector3d centreCt() const { return centre_ct_; }
  std::string deviceName() const;
  std::size_t deviceBytes() const;
  const NodeParameters& parameters() const { return parameters_; }
  /// The registrar, for tools that start their own trials; null before openDevice.
  Registrar* registrar() { return registrar_.get(); }
  /// The CT as it was read, until the next one is read or dropCt() is called; for the bone surface.
  std::shared_ptr<const Volume> ct() const { return ct_; }
  void dropCt() { ct_.reset(); }

 private:
  std::unique_ptr<Registrar> registrarFromDevice(const RegistrarOptions& options);
  void loadMasks();
  void upload();
  bool rebuildAfter(const std::string& failure);
  FrameOutcome refused(const std::string& reason) const;
  void registerViews(double stamp_s, const std::vector<ViewInput>& present,
                     const std::optional<RigidTransform>& T_camera_now_camera_last, FrameOutcome* outcome);

  NodeParameters parameters_;
  Logger logger_;
  RegistrarFactory factory_;
  std::map<std::string, MaskImage> masks_;
  mutable std::map<std::string, UndistortionMaps> maps_;  ///< By view, kept between frames.
  std::shared_ptr<Device> device_;
  std::unique_ptr<Registrar> registrar_;  ///< After device_: destroyed before it.
  Tracker tracker_;
  std::shared_ptr<const Volume> ct_;
  std::shared_ptr<const AttenuationVolume> attenuation_;
  std::string ct_name_;
  Eigen::Vector3d centre_ct_ = Eigen::Vector3d::Zero();
  std::optional<double> last_accepted_s_;
  std::string fault_;
  bool rebuilt_since_success_ = false;
};

}  // namespace xray_registration

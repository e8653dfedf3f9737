#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"
#include "xray_registration/image/xray_frame.h"
#include "xray_registration/registration/body.h"
#include "xray_registration/registration/registrar_options.h"
#include "xray_registration/registration/suspicion.h"
#include "xray_registration/registration/wide_search.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// What one view contributes to a frame: its X-ray, shared by everybody who looks at it and never changed, and where it
/// was taken from. An empty mask means all pixels. The first view's T_view_first is the identity.
struct ViewInput {
  /// Implicit, so that an X-ray alone is a view.
  ViewInput(XrayFrame frame) : xray(std::make_shared<const XrayFrame>(std::move(frame))) {}  // NOLINT
  explicit ViewInput(std::shared_ptr<const XrayFrame> frame,
                     const RigidTransform& T_view_first_in = RigidTransform::Identity())
      : xray(std::move(frame)), T_view_first(T_view_first_in) {}

  std::shared_ptr<const XrayFrame> xray;  ///< Never null.
  RigidTransform T_view_first = RigidTransform::Identity();
  std::string name;  ///< Of the view, for whoever reads a reason; may be empty.
};

/// What a registration found for one frame, accepted or not; the pose is the CT's in the first view's camera frame.
struct RegistrationResult {
  RigidTransform T_camera_ct = RigidTransform::Identity();
  bool accepted = false;
  std::string reason;   ///< Why not accepted, in plain words; empty when accepted.
  bool solved = false;  ///< The solver ran; without it the pose is the start and the numbers below mean nothing.
  bool converged = false;
  int iterations = 0;             ///< Gauss-Newton steps over all levels.
  double similarity = 0.0;        ///< Mean correlation of the windows, −1…1.
  double residual = 0.0;          ///< Root mean square of the weighted residual of the last level.
  double inlier_fraction = 0.0;   ///< Share of the CT's shadow that is recognised: windows that correlate well.
  double condition_number = 0.0;  ///< Of the normal matrix, rotation scaled by the target radius.
  Matrix6d covariance = Matrix6d::Zero();  ///< [mm; rad], translation then rotation about the CT centre, camera axes.
  bool compared = false;                   ///< A cold start that was not sure looked for other places and solved again:
  double rival_similarity = -1.0;          ///< of the best at another place, −1 where nothing was; and
  double disagreement_mm = 0.0;            ///< from the nearest other solve, in-plane.
  std::vector<BodyResult> bodies;          ///< In the order of setBodies; empty when the CT was not accepted.
  std::vector<SetupSuspicion> suspicions;  ///< About what was told, as of the last frame that was looked at.
  double solve_ms = 0.0;
  double upload_ms = 0.0;
};

/// Registers frames against one resident CT. Two implementations: the fast method and the paper's. Not thread-safe: one
/// worker owns it. Device failures throw DeviceError; everything else is said in the result, never a NaN.
class Registrar {
 public:
  virtual ~Registrar() = default;

  /// Uploads the CT (and its pyramid); the previous one is released first. Runs the self-test.
  /// @throws DeviceError when the device fails, disagrees with the reference, or has no room.
  virtual void setVolume(const AttenuationVolume& volume) = 0;
  virtual bool hasVolume() const = 0;

  /// Adds bodies that move on their own to the CT of setVolume, which has them where they were; `rest` is that CT
  /// without them. A new setVolume forgets them. @throws DeviceError; std::invalid_argument when this implementation
  /// knows no bodies.
  virtual void setBodies(const AttenuationVolume& rest, const std::vector<BodyModel>& bodies);

  /// Registers one frame from a start pose. `tracking` says that the start is the prediction from an accepted
  /// neighbour, so coarse levels may be skipped and the jump from the start is judged.
  virtual RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start,
                                           bool tracking) = 0;

  /// Registers one frame as a cold start from the most alike of several places (not empty), in whose neighbourhood the
  /// CT is if it is in any of theirs; the others are rivals that the result has to stand above.
  virtual RegistrationResult registerAmong(const std::vector<ViewInput>& views,
                                           const std::vector<RigidTransform>& T_camera_ct_starts) {
    return registerFrame(views, T_camera_ct_starts.front(), false);
  }

  /// Looks for the CT far from any start; null where this implementation cannot, or has no CT. What it finds is for
  /// registerAmong. It ends before the registrar's CT does. @throws DeviceError.
  virtual std::unique_ptr<WideSearch> searchWidely(const std::vector<ViewInput>& /*views*/,
                                                   const WideSearchRange& /*range*/) {
    return nullptr;
  }

  /// Registers the bodies in the frame that registerFrame has just accepted, from a start for each, and refines the
  /// CT's pose, which then is the rest's, with them around it.
  virtual std::vector<BodyResult> registerBodies(const std::vector<BodyStart>& /*starts*/,
                                                 RegistrationResult* /*rest*/) {
    return {};
  }

  /// Forgets what earlier frames taught (levels, scales, choices): the next frame is a cold start, whatever `tracking`
  /// says. Called when the pose is forgotten.
  virtual void forget() {}

  /// DRR in line integrals (dimensionless) on the finest level.
  virtual FloatImage renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) = 0;

  /// The same in parts whose line integrals add: the CT without the bodies of setBodies, then each of them where it is
  /// (one pose for each). The whole CT alone where this implementation knows no bodies.
  virtual std::vector<FloatImage> renderParts(const XrayCamera& camera, const RigidTransform& T_camera_ct,
                                              const std::vector<RigidTransform>& /*T_camera_bodies*/) {
    return {renderDrr(camera, T_camera_ct)};
  }

  /// The point in the CT frame that errors and updates are expressed about, mm.
  virtual Eigen::Vector3d centreCt() const = 0;

  /// Takes new thresholds and tuning from the next frame on. False: this implementation has to be made anew for that.
  virtual bool setOptions(const RegistrarOptions& /*options*/) { return false; }

  virtual std::string deviceName() const = 0;
  virtual std::size_t deviceBytes() const = 0;
};

}  // namespace xray_registration

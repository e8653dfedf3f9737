#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/common/session_bodies.h"
#include "tools/common/trajectory.h"
#include "xray_registration/evaluation/xray_simulator.h"
#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration::tools {

/// An X-ray camera on a C-arm: turned about the CT's long axis, the CT's centre in the middle of its image.
struct ViewSetup {
  std::string name;
  double angle_deg = 0.0;  ///< 0: antero-posterior. 90: lateral, from the patient's left.
};

/// "ap:0,oblique:-50" → two setups.
/// @throws ArgumentError for a missing or repeated name, or an angle that is not a number.
std::vector<ViewSetup> parseViews(const std::string& text);

/// Everything that a simulated session is made of. The same setup gives the same images and poses.
struct SessionSetup {
  std::vector<ViewSetup> views = {{"ap", 0.0}};
  int image_size = 256;
  double detector_mm = 300.0;  ///< Side of the square detector.
  double source_detector_mm = 1200.0;
  double source_centre_mm = 800.0;  ///< Distance from the source to the CT's centre.
  double amplitude_mm = 10.0;
  double amplitude_deg = 6.0;
  double period_s = 6.0;  ///< Of the patient's motion.
  std::uint64_t seed = 1;
  bool instrument = false;  ///< A rod and a ball of metal that do not move with the patient.
  XrayPhysics physics;
  AttenuationModel attenuation;
  SessionBodies bodies;  ///< Structures that move on their own; none: the CT is one piece.

  /// @throws ArgumentError naming the value that is out of range.
  void check() const;
};

/// Makes the X-rays and true poses of a session. Thread-safe once made.
class SessionGenerator {
 public:
  /// @param labels  of the setup's bodies; not looked at when there are none.
  /// @throws VolumeError when a body's label selects nothing.
  SessionGenerator(const Volume& ct, SessionSetup setup, const LabelVolume& labels = {});

  const SessionSetup& setup() const { return setup_; }
  const XrayCamera& camera() const { return camera_; }  ///< The same for all views.
  const Eigen::Vector3d& centreCt() const { return centre_ct_mm_; }

  /// Maps points of the first view's camera frame into that of view `view`.
  RigidTransform viewFromFirst(std::size_t view) const;

  /// True pose of the CT at a time of the motion.
  RigidTransform cameraFromCt(std::size_t view, double time_s) const;

  /// True pose of one of the setup's bodies, and its centre where the CT has it.
  RigidTransform cameraFromBody(std::size_t view, std::size_t body, double time_s) const;
  const Eigen::Vector3d& bodyCentreCt(std::size_t body) const { return bodies_->centreCt(body); }

  /// X-ray of frame number `frame`, taken at `time_s`; the number alone seeds its noise.
  Image<std::uint16_t> xray(std::size_t view, std::size_t frame, double time_s) const;

 private:
  std::vector<PosedVolume> partsAt(std::size_t view, double time_s) const;

  SessionSetup setup_;
  AttenuationVolume volume_;
  XrayCamera camera_;
  Eigen::Vector3d centre_ct_mm_;
  Trajectory trajectory_;
  std::optional<MovingBodies> bodies_;
  std::vector<RigidTransform> T_view_ct_at_rest_;
};

}  // namespace xray_registration::tools

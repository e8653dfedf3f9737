#pragma once

#include <memory>
#include <string>
#include <vector>

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/volume/bone_surface.h"

namespace xray_registration {

/// What is followed, to be shown.
struct ShownShape {
  std::string name;                                     ///< Of a body; empty: the CT.
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< That it is turned about, in its own frame.
  std::shared_ptr<const TriangleMesh> mesh;             ///< Its surface; never null, empty where none was made.
};

/// Is told what the worker finds, on the worker's thread, but takeShapes, which comes from one that makes surfaces.
/// Returns soon.
class ResultListener {
 public:
  virtual ~ResultListener() = default;
  /// In place of all shapes that were there; no pose of them is known.
  virtual void takeShapes(std::vector<ShownShape> shapes) = 0;
  /// The first view's optical frame, and its camera in the newest frame that was prepared.
  virtual void takeCamera(const std::string& camera_frame, const XrayCamera& camera) = 0;
  /// Nothing that was found holds any more (~reset).
  virtual void forgetPoses() = 0;
  /// What became of a registration, accepted or not.
  virtual void takeResult(const RegistrationResult& result) = 0;
};

}  // namespace xray_registration

#pragma once

#include <memory>
#include <vector>

#include "registration/view_preparation.h"
#include "xray_registration/drr/engine.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// A body around the one that is registered: its CT is on the engine.
struct Surrounding {
  Engine* engine = nullptr;
  RigidTransform T_camera_body = RigidTransform::Identity();
};

/// Where a body's corners are, and how far around them it may be.
struct BodyPlace {
  std::vector<Eigen::Vector3d> points_mm;
  RigidTransform T_camera_body = RigidTransform::Identity();
  double margin_mm = 0.0;
};

/// The views of one frame on the device, each cropped to where the CT can be and binned to what the solver can use.
class DeviceViews {
 public:
  struct View {
    std::unique_ptr<ResidentXray> xray;
    XrayCamera told;  ///< Of the image as it came, before cropping and binning.
    RigidTransform T_view_first = RigidTransform::Identity();
    Matrix6d twist_carried = Matrix6d::Identity();  ///< First camera's twist → this camera's.
    const ResidentXray::Level& level(int index) const { return xray->level(index); }
  };

  /// The engine has its volume and outlives this.
  explicit DeviceViews(Engine* engine) : engine_(engine) {}

  /// Takes a frame's views in place of the last one's, as seen from where the solve starts; binned until no more than
  /// `max_image_pixels` of a view's pixels have CT behind them, and then halved `halvings` times more. Where the CT may
  /// be further than `reach_mm` from the start, at its border, crops are larger; less than 0: not known.
  /// @throws DeviceError.
  void upload(const std::vector<ViewInput>& inputs, const RigidTransform& T_camera_ct_start, double max_image_pixels,
              double reach_mm = -1.0, int halvings = 0);

  /// Looks at another's views, which stay there, for the body on this engine: tiles and surroundings are its own.
  void shareFrom(const DeviceViews& other);

  /// Uses only tiles that the shadows of bodies touch.
  void limitTo(const std::vector<BodyPlace>& bodies);

  /// Leaves out the tiles that the shadows of bodies touch, in place of what was left out before.
  void leaveOut(const std::vector<BodyPlace>& bodies);

  /// What is around the body, in place of what was: X-rays are compared with the sum of all line integrals. What
  /// surrounds `backdrop`, a look at the same views on all tiles that this one uses, is part of it. Engines and
  /// backdrop outlive this.
  void surroundBy(std::vector<Surrounding> surroundings, DeviceViews* backdrop = nullptr);

  /// Draws what surrounds the body on a level, unless that was done; before every evaluation.
  void drawSurroundings(const View& view, int level);

  /// The detector saturates there (ResidentXray::setSaturation).
  void setSaturation(double line_integral);

  const std::vector<View>& views() const { return views_; }
  std::size_t size() const { return views_.size(); }

  /// Whether the CT's centre lies in some view's image or at most half an image beside it.
  bool seesCentre(const RigidTransform& T_camera_ct) const;

  /// The coarsest pyramid level that every view has.
  int lastLevel() const;
  /// The coarsest one on which the CT still has a shadow of some size in every view.
  int coarsestLevel(const RigidTransform& T_camera_ct);

  /// Weights as seen from a pose: with `leave_out_unexplained` rays that the CT cannot explain lose theirs. Returns
  /// whether any view lost rays.
  bool weigh(bool leave_out_unexplained, const RigidTransform& T_camera_ct);

  /// Uses only the `part` of the finest level's tiles in which the X-rays vary most, until they are weighed anew.
  void keepContrastTiles(double part);
  /// Brings them back.
  void useAllTiles();

  /// From the source to the CT's centre, mm; at least 1.
  double depthOf(const RigidTransform& T_view_ct) const;
  /// The CT's level whose voxels project to about a pixel.
  int volumeLevel(const XrayCamera& camera, const RigidTransform& T_view_ct) const;
  const Eigen::Vector3d& centreCt() const { return engine_->volume().centreCt(); }

 private:
  int binningFor(const XrayCamera& whole, const RigidTransform& T_view_ct, double max_image_pixels);
  std::vector<PixelBox> shadowsIn(const View& view, const std::vector<BodyPlace>& bodies) const;
  ShadowBounds boundsOf(const RigidTransform& T_view_ct, double reach_mm) const;
  double shadowPixels(const XrayCamera& camera, const RigidTransform& T_view_ct);

  Engine* engine_;
  std::vector<View> views_;
  std::vector<Surrounding> surroundings_;
  DeviceViews* backdrop_ = nullptr;
};

}  // namespace xray_registration

#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "registration/body_judgement.h"
#include "registration/body_objective.h"
#include "registration/device_views.h"
#include "registration/solution.h"
#include "xray_registration/registration/body.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/volume/solid_overlap.h"

namespace xray_registration {

/// The bodies of a CT that move on their own, each on an engine of its own beside the rest's. Line integrals add: each
/// is registered with the rest and all others around it, and so is the rest. @throws DeviceError from every call.
class MovingBodies {
 public:
  /// Puts the rest and all bodies on siblings of `whole`, which holds the whole CT.
  MovingBodies(Engine* whole, const AttenuationVolume& rest, const std::vector<BodyModel>& models);

  Engine* restEngine() const { return rest_engine_.get(); }

  /// The rest's look at the views of a frame, with the bodies around it where they were last seen against it.
  DeviceViews* viewsOfRest(const DeviceViews& whole, const RigidTransform& T_camera_ct);

  /// Registers all bodies where the rest is, then the rest among them (`rest` moves), then the bodies again where that
  /// is worth it. `views` are the whole CT's.
  std::vector<BodyResult> registerIn(const DeviceViews& views, const std::vector<BodyStart>& starts,
                                     const RegistrarOptions& options, Solution* rest);

  /// Leaves the bodies' shadows out of the whole CT's views: for who asks whether the CT is right, where it has them at
  /// places that they have left.
  void leaveOutOf(DeviceViews* whole, const RigidTransform& T_camera_ct) const;

  /// Line integrals of the rest, then of each body.
  std::vector<FloatImage> render(const XrayCamera& camera, const RigidTransform& T_camera_ct,
                                 const std::vector<RigidTransform>& T_camera_bodies) const;

  /// The next frame is a cold start of every body.
  void forget();

 private:
  struct Body {
    BodyModel model;
    std::unique_ptr<Engine> engine;
    std::unique_ptr<DeviceViews> views;
    std::vector<Eigen::Vector3d> corners_ct_mm;
    std::shared_ptr<const SolidBody> solid;
    RigidTransform T_ct_body = RigidTransform::Identity();  ///< As last seen; the identity before.
    bool found = false;                                     ///< By a cold start that was accepted.
  };

  /// A frame while its bodies are solved.
  struct Frame {
    const DeviceViews& views;
    const RegistrarOptions& options;
    Solution* rest;
    std::vector<BodyStart> starts;
    std::vector<RigidTransform> T_ct_body;  ///< As far as is known.
    std::vector<BodyCues> cues;
    std::vector<StepBudget> budgets;
  };

  /// The farthest that a body's centre lies from where it was.
  double farthestMm(const std::vector<RigidTransform>& T_ct_body, const std::vector<RigidTransform>& T_ct_before) const;
  bool isTracked(const Frame& frame, std::size_t body) const;
  /// All bodies but one, where the frame has them.
  std::vector<Surrounding> othersThan(std::size_t body, const RigidTransform& T_camera_ct,
                                      const std::vector<RigidTransform>& T_ct_body) const;
  /// Where a body is looked for at first, and around what was found.
  BodyPlace expected(const Frame& frame, std::size_t body) const;
  BodyPlace found(const Frame& frame, std::size_t body) const;
  /// The rest behind the bodies, drawn once for all that look there.
  void drawBackdrop(const Frame& frame, const std::vector<BodyPlace>& places);
  /// Solves for each body in turn, with all others where they are by then.
  void solveEach(Frame* frame, const std::vector<BodyPlace>& places,
                 const std::function<void(std::size_t body, BodyObjective*)>& solve);
  void search(Frame* frame, std::size_t body, BodyObjective* objective);
  void refine(Frame* frame, std::size_t body, BodyObjective* objective);
  void refineRest(Frame* frame);
  std::vector<BodyResult> judge(const Frame& frame);
  Eigen::MatrixXd overlapsMm3(const std::vector<RigidTransform>& T_ct_body) const;

  std::unique_ptr<Engine> rest_engine_;
  std::unique_ptr<DeviceViews> rest_views_;
  std::unique_ptr<DeviceViews> backdrop_;
  std::vector<Body> bodies_;
};

}  // namespace xray_registration

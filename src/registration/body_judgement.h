#pragma once

#include "registration/cold_start.h"
#include "registration/device_views.h"
#include "registration/solution.h"
#include "xray_registration/registration/body.h"
#include "xray_registration/registration/registrar_options.h"

namespace xray_registration {

/// What is known about a body's solution when it is judged.
struct BodyCues {
  Solution solution;
  RigidTransform T_camera_ct = RigidTransform::Identity();  ///< Of the rest.
  Rival rival;
  std::vector<double> views;  ///< Similarity of each view that shows something of it; empty when not asked.
  int exceeded_steps = 0;
};

/// Refuses bodies whose solids lie in one place (`overlaps_mm3`, bodies × bodies) where both were accepted.
void refuseOverlaps(const Eigen::MatrixXd& overlaps_mm3, const BodyAcceptOptions& accept,
                    std::vector<BodyResult>* results);

/// Fills the body's numbers from its solution, and accepts or refuses it.
BodyResult judgeBody(const DeviceViews& views, const BodyModel& model, const BodyCues& cues,
                     const RegistrarOptions& options);

}  // namespace xray_registration

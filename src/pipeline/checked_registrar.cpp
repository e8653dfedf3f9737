#include "pipeline/checked_registrar.h"

#include <utility>

namespace xray_registration {
namespace {

RegistrationResult finite(RegistrationResult result) {
  if (result.T_camera_ct.matrix().allFinite()) return result;
  result = RegistrationResult{};
  result.reason = "the registration gave a pose that is not finite";
  return result;
}

}  // namespace

RegistrationResult CheckedRegistrar::registerFrame(const std::vector<ViewInput>& views,
                                                   const RigidTransform& T_first_ct_start, bool tracking) {
  const RigidTransform T_base_first = views.front().T_view_first;
  if (T_base_first.isApprox(RigidTransform::Identity(), 0.0)) {
    return finite(registrar_->registerFrame(views, T_first_ct_start, tracking));
  }
  const RigidTransform T_first_base = T_base_first.inverse();
  std::vector<ViewInput> rebased = views;
  for (ViewInput& view : rebased) view.T_view_first = view.T_view_first * T_first_base;
  rebased.front().T_view_first = RigidTransform::Identity();
  RegistrationResult result = registrar_->registerFrame(rebased, T_base_first * T_first_ct_start, tracking);
  result.T_camera_ct = T_first_base * result.T_camera_ct;
  const Matrix6d turn = twistCarriedBy(T_first_base);
  result.covariance = turn * result.covariance * turn.transpose();
  return finite(std::move(result));
}

}  // namespace xray_registration

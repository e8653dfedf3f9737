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

RegistrationResult CheckedRegistrar::inCallersFrame(RegistrationResult result) const {
  result.T_camera_ct = T_first_base_ * result.T_camera_ct;
  const Matrix6d turn = twistCarriedBy(T_first_base_);
  result.covariance = turn * result.covariance * turn.transpose();
  return result;
}

RegistrationResult CheckedRegistrar::registerBased(const std::vector<ViewInput>& views,
                                                   const RigidTransform& T_base_first,
                                                   const RigidTransform& T_first_ct_start, bool tracking) {
  if (T_first_ct_places_.empty()) return registrar_->registerFrame(views, T_base_first * T_first_ct_start, tracking);
  std::vector<RigidTransform> T_base_ct_places;
  for (const RigidTransform& place : T_first_ct_places_) T_base_ct_places.emplace_back(T_base_first * place);
  return registrar_->registerAmong(views, T_base_ct_places);
}

RegistrationResult CheckedRegistrar::registerFrame(const std::vector<ViewInput>& views,
                                                   const RigidTransform& T_first_ct_start, bool tracking) {
  const RigidTransform T_base_first = views.front().T_view_first;
  T_first_base_ = T_base_first.inverse();
  if (T_base_first.isApprox(RigidTransform::Identity(), 0.0)) {
    T_first_base_.setIdentity();
    return finite(registerBased(views, T_base_first, T_first_ct_start, tracking));
  }
  std::vector<ViewInput> rebased = views;
  for (ViewInput& view : rebased) view.T_view_first = view.T_view_first * T_first_base_;
  rebased.front().T_view_first = RigidTransform::Identity();
  return finite(inCallersFrame(registerBased(rebased, T_base_first, T_first_ct_start, tracking)));
}

std::vector<BodyResult> CheckedRegistrar::registerBodies(const std::vector<BodyStart>& starts,
                                                         RegistrationResult* rest) {
  const RigidTransform T_base_first = T_first_base_.inverse();
  const Matrix6d turn = twistCarriedBy(T_base_first);
  rest->T_camera_ct = T_base_first * rest->T_camera_ct;
  rest->covariance = turn * rest->covariance * turn.transpose();
  std::vector<BodyResult> bodies = registrar_->registerBodies(starts, rest);
  *rest = finite(inCallersFrame(*rest));
  const Matrix6d back = turn.transpose();
  for (BodyResult& body : bodies) {
    body.T_camera_body = T_first_base_ * body.T_camera_body;
    body.covariance = back * body.covariance * back.transpose();
    if (body.T_camera_body.matrix().allFinite()) continue;
    body.accepted = body.solved = false;
    body.T_camera_body = rest->T_camera_ct;
    body.reason = "the registration gave a pose that is not finite";
  }
  return bodies;
}

}  // namespace xray_registration

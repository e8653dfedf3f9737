// What a RegistrationPipeline shows of its results.
#include <algorithm>
#include <new>
#include <optional>
#include <utility>

#include "pipeline/body_volumes.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/volume/body_cut.h"

namespace xray_registration {
namespace {

/// Of a low threshold for bone, at the least, what a cut body's surface is: at zero there is none.
constexpr double kLeastCutShare = 0.05;

bool isOnlyBody(const std::vector<BodyModel>& bodies) { return bodies.size() == 1 && bodies.front().name == kOnlyBody; }

/// A mesh is solid: its surface lies where half of a voxel is.
double surfaceOf(const std::vector<BodyParameters>& bodies, const std::string& name, double bone_per_mm) {
  const auto found =
      std::find_if(bodies.begin(), bodies.end(), [&](const BodyParameters& body) { return body.name == name; });
  return found != bodies.end() && !found->mesh.empty() ? 0.5 * found->attenuation_per_mm : bone_per_mm;
}

}  // namespace

FloatImage RegistrationPipeline::renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  if (!body_.registrar) return {};
  try {
    return body_.registrar->renderDrr(camera, T_camera_ct);
  } catch (const DeviceError& error) {
    rebuildAfter(error.what());
  } catch (const std::bad_alloc&) {
    log(logger_, LogLevel::kError, "no DRR is drawn: out of memory");
  }
  return {};
}

DrrParts RegistrationPipeline::renderParts(const ViewInput& view, const RegistrationResult& result) {
  if (!body_.registrar) return {};
  try {
    return renderAll(view, result);
  } catch (const DeviceError& error) {
    rebuildAfter(error.what());
  } catch (const std::bad_alloc&) {
    log(logger_, LogLevel::kError, "no DRR is drawn: out of memory");
  }
  return {};
}

/// Of a body that is registered by itself; null for others.
Registrar* RegistrationPipeline::registrarOf(const std::string& body) {
  if (first_is_body_ && body == body_.name) return body_.registrar.get();
  const auto found =
      std::find_if(own_.begin(), own_.end(), [&](const RegisteredBody& own) { return own.name == body; });
  return found == own_.end() ? nullptr : found->registrar.get();
}

DrrParts RegistrationPipeline::renderAll(const ViewInput& view, const RegistrationResult& result) {
  DrrParts parts;
  parts.bodies.resize(result.bodies.size());
  for (std::size_t i = 0; i < result.bodies.size(); ++i) {
    const BodyResult& body = result.bodies[i];
    Registrar* registrar = registrarOf(body.name);
    if (registrar == nullptr || !body.solved) continue;
    parts.bodies[i] = registrar->renderDrr(view.xray->camera, view.T_view_first * body.T_camera_body);
  }
  if (!first_is_body_) renderCut(view, result, &parts);
  return parts;
}

/// The CT, and the bodies that are cut out of it.
void RegistrationPipeline::renderCut(const ViewInput& view, const RegistrationResult& result, DrrParts* parts) {
  std::vector<RigidTransform> T_view_bodies;
  std::vector<std::optional<std::size_t>> places;  // Of these bodies in the result.
  for (const BodyModel& model : body_.bodies) {
    const auto found = std::find_if(result.bodies.begin(), result.bodies.end(),
                                    [&](const BodyResult& body) { return body.name == model.name; });
    const bool known = found != result.bodies.end() && found->solved;
    T_view_bodies.emplace_back(view.T_view_first * (known ? found->T_camera_body : result.T_camera_ct));
    places.emplace_back();
    if (known) places.back() = static_cast<std::size_t>(found - result.bodies.begin());
  }
  const XrayCamera& camera = view.xray->camera;
  const RigidTransform T_view_ct = view.T_view_first * result.T_camera_ct;
  // With ct/label alone the result is that structure's, and where what is around it lies, is not in it.
  const bool shows_only_body = result.accepted && isOnlyBody(body_.bodies);
  const bool knows_bodies = std::any_of(places.begin(), places.end(), [](const auto& place) { return place; });
  if (!shows_only_body && !knows_bodies) {
    parts->ct = body_.registrar->renderDrr(camera, T_view_ct);
    return;
  }
  std::vector<FloatImage> images = body_.registrar->renderParts(camera, T_view_ct, T_view_bodies);
  for (std::size_t i = 0; i < places.size() && i + 1 < images.size(); ++i) {
    if (places[i]) parts->bodies[*places[i]] = images[i + 1];
  }
  parts->ct = std::move(shows_only_body ? images.back() : images.front());
}

std::vector<BodyShape> RegistrationPipeline::shapes() const {
  std::vector<BodyShape> shapes;
  if (!hasCt()) return shapes;
  const CtParameters& ct = parameters_.ct;
  const double bone_per_mm = ct.model.water_per_mm * (1.0 + ct.surface_threshold_hu / 1000.0);
  // A body that was cut out is what lies above the soft tissue that it displaces.
  const double cut_bone_per_mm = bone_per_mm - ct.model.water_per_mm * (1.0 + kFillHu / 1000.0);
  const auto add_own = [&](const RegisteredBody& body) {
    shapes.push_back({body.name, body.attenuation, surfaceOf(parameters_.bodies, body.name, bone_per_mm)});
  };
  if (first_is_body_) {
    add_own(body_);
  } else if (!isOnlyBody(body_.bodies)) {
    shapes.push_back({"", body_.rest ? body_.rest : body_.attenuation, bone_per_mm});
  }
  for (const BodyModel& body : body_.bodies) {
    shapes.push_back({body.name == kOnlyBody ? "" : body.name, std::make_shared<const AttenuationVolume>(body.volume),
                      std::max(cut_bone_per_mm, kLeastCutShare * ct.model.water_per_mm)});
  }
  for (const RegisteredBody& body : own_) add_own(body);
  return shapes;
}

}  // namespace xray_registration

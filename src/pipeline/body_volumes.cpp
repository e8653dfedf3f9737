#include "pipeline/body_volumes.h"

#include <algorithm>
#include <utility>

#include "xray_registration/volume/body_cut.h"
#include "xray_registration/volume/segment_names.h"
#include "xray_registration/volume/surface_mesh.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {
namespace {

/// Line integral at which a detector is taken to saturate behind metal: a knee implant's thickness times 0.25 /mm is 2
/// to 7, and its inside is one grey. With 1 both implants of a real knee come right, with less one of them does
/// (docs/design.md).
constexpr double kMetalSaturation = 1.0;

std::vector<int> labelsOf(const BodyParameters& body, const CtParameters& ct) {
  std::vector<int> labels = body.labels;
  if (!body.label_names.empty()) {
    const std::vector<int> named = labelsNamed(body.label_names, ct.mask, ct.read.directory);
    labels.insert(labels.end(), named.begin(), named.end());
  }
  return labels;
}

/// The bodies that are cut out of the CT: those of the list, or the one of ct/label.
std::vector<BodyParameters> cutBodiesOf(const NodeParameters& parameters) {
  std::vector<BodyParameters> bodies;
  if (parameters.ct.mask.empty()) return bodies;
  for (const BodyParameters& body : parameters.bodies) {
    if (body.isCutFromCt()) bodies.push_back(body);
  }
  if (parameters.bodies.empty()) {
    BodyParameters only;
    only.name = kOnlyBody;
    only.labels = {parameters.ct.label};
    bodies.push_back(only);
  }
  return bodies;
}

CutCt cut(const Volume& ct, const NodeParameters& parameters, const std::vector<BodyParameters>& bodies,
          const Logger& logger) {
  std::vector<std::vector<int>> labels;
  labels.reserve(bodies.size());
  for (const BodyParameters& body : bodies) labels.push_back(labelsOf(body, parameters.ct));
  return cutBodies(ct, parameters.ct.model, readLabels(parameters.ct.mask, parameters.ct.read, logger), labels);
}

AttenuationVolume volumeOf(const BodyParameters& body, const Volume* ct, const NodeParameters& parameters,
                           const Logger& logger) {
  const CtParameters& how = parameters.ct;
  if (!body.mesh.empty()) {
    return voxelise(readMesh(body.mesh, how.read.directory), body.attenuation_per_mm, 0.0, body.mesh);
  }
  if (!body.ct.empty()) return toAttenuation(readVolume(body.ct, how.read, logger), how.model);
  return toAttenuation(*ct, how.model, readLabels(how.mask, how.read, logger), labelsOf(body, how));
}

}  // namespace

CtParts partsOf(const Volume& ct, const NodeParameters& parameters, const Logger& logger) {
  CtParts parts;
  const std::vector<BodyParameters> bodies = cutBodiesOf(parameters);
  if (bodies.empty() || !parameters.ct.rest) {
    const bool masked = !parameters.ct.mask.empty() && parameters.bodies.empty();
    parts.whole = std::make_shared<const AttenuationVolume>(
        masked ? toAttenuation(ct, parameters.ct.model, readLabels(parameters.ct.mask, parameters.ct.read, logger),
                               std::vector<int>{parameters.ct.label})
               : toAttenuation(ct, parameters.ct.model));
    return parts;
  }
  CutCt pieces = cut(ct, parameters, bodies, logger);
  parts.whole = std::make_shared<const AttenuationVolume>(std::move(pieces.whole));
  parts.rest = std::make_shared<const AttenuationVolume>(std::move(pieces.rest));
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Eigen::Vector3d centre_ct_mm = anatomicalCentreCt(pieces.bodies[i]);
    parts.bodies.push_back({bodies[i].name, std::move(pieces.bodies[i]), bodies[i].max_rotation_rad,
                            bodies[i].max_translation_mm, centre_ct_mm});
  }
  return parts;
}

std::vector<RegisteredBody> bodiesOfTheirOwn(const Volume* ct, const NodeParameters& parameters, const Logger& logger) {
  std::vector<RegisteredBody> own;
  for (const BodyParameters& body : parameters.bodies) {
    if (body.isCutFromCt() && (parameters.ct.rest || ct == nullptr)) continue;
    RegisteredBody registered(parameters.tracker);
    registered.name = body.name;
    registered.attenuation = std::make_shared<const AttenuationVolume>(volumeOf(body, ct, parameters, logger));
    registered.range =
        BodyRange{body.max_rotation_rad, body.max_translation_mm, body.mesh.empty() ? 0.0 : kMetalSaturation};
    registered.T_camera_ct_configured = body.initial_pose;
    own.push_back(std::move(registered));
  }
  return own;
}

}  // namespace xray_registration

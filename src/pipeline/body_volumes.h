#pragma once

#include <memory>
#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/pipeline/registered_body.h"
#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// What of a CT is put on the device.
struct CtParts {
  std::shared_ptr<const AttenuationVolume> whole;
  std::shared_ptr<const AttenuationVolume> rest;  ///< Null where no body is cut out, or nothing else is known.
  std::vector<BodyModel> bodies;
};

/// The name of the one body that ct/mask and ct/label mean without a list `bodies`.
constexpr char kOnlyBody[] = "ct";

/// The CT with the bodies that move in the rest of it (ct/rest). @throws VolumeError.
CtParts partsOf(const Volume& ct, const NodeParameters& parameters, const Logger& logger);

/// The bodies that are registered by themselves: those with a CT or a mesh of their own, and without ct/rest those that
/// `ct` has as well; null when there is no CT. In the order of the parameters. @throws VolumeError.
std::vector<RegisteredBody> bodiesOfTheirOwn(const Volume* ct, const NodeParameters& parameters, const Logger& logger);

}  // namespace xray_registration

#include "xray_registration/registration/registrar.h"

#include <stdexcept>

namespace xray_registration {

void Registrar::setBodies(const AttenuationVolume& /*rest*/, const std::vector<BodyModel>& bodies) {
  if (!bodies.empty()) throw std::invalid_argument("bodies with poses of their own need method: fast");
}

}  // namespace xray_registration

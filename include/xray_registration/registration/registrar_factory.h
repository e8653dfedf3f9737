#pragma once

#include <memory>

#include "xray_registration/drr/device.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/registrar_options.h"

namespace xray_registration {

/// The registrar that `options.method` names, on `device`. Warms up: compiles, first launches, self-test.
std::unique_ptr<Registrar> makeRegistrar(std::shared_ptr<Device> device, const RegistrarOptions& options,
                                         const Logger& logger);

}  // namespace xray_registration

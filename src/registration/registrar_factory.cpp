#include "xray_registration/registration/registrar_factory.h"

#include "xray_registration/registration/fast_registrar.h"
#include "xray_registration/registration/paper/paper_registrar.h"

namespace xray_registration {

std::unique_ptr<Registrar> makeRegistrar(std::shared_ptr<Device> device, const RegistrarOptions& options,
                                         const Logger& logger) {
  if (options.method == Method::kPaper) return std::make_unique<PaperRegistrar>(std::move(device), options, logger);
  return std::make_unique<FastRegistrar>(std::move(device), options, logger);
}

}  // namespace xray_registration

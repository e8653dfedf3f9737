#include "xray_registration/pipeline/device_host.h"

#include <utility>

#include "pipeline/failure_text.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/registration/registrar_factory.h"

namespace xray_registration {

DeviceHost::DeviceHost(std::string device, const RegistrarOptions& options, Logger logger)
    : device_choice_(std::move(device)), options_(options), logger_(std::move(logger)) {}

DeviceHost::DeviceHost(RegistrarFactory factory, const RegistrarOptions& options, Logger logger)
    : factory_(std::move(factory)), options_(options), logger_(std::move(logger)) {}

std::unique_ptr<Registrar> DeviceHost::makeRegistrar(const RegistrarOptions& options) {
  std::unique_ptr<Registrar> registrar;
  if (factory_) {
    registrar = factory_(options);
  } else {
    if (!device_) device_ = std::make_shared<Device>(device_choice_, logger_);
    registrar = xray_registration::makeRegistrar(device_, options, logger_);
  }
  device_name_ = registrar->deviceName();
  return registrar;
}

void DeviceHost::close(RegisteredBody* body) {
  if (body != nullptr) body->registrar.reset();
  spare_.reset();
  device_.reset();
  device_name_.clear();
}

template <typename Work>
void DeviceHost::doOrFault(const std::string& what_failed, RegisteredBody* body, const Work& work) {
  try {
    work();
    fault_.clear();
  } catch (const DeviceError& error) {
    close(body);
    fault_ = error.what();
    throw;
  } catch (const std::exception& error) {
    // Memory of the host, most of all: a registrar that it interrupted is not to be trusted either.
    close(body);
    fault_ = what_failed + ": " + inWords(error);
    throw DeviceError(fault_, 0);
  }
}

void DeviceHost::open() {
  if (!device_name_.empty()) return;
  doOrFault("the device cannot be opened", nullptr, [this] { spare_ = makeRegistrar(options_); });
}

void DeviceHost::upload(RegisteredBody* body) {
  try {
    uploadOnce(body);
  } catch (const DeviceError& error) {
    constexpr int kNotOfTheDriver = 0;
    if (rebuilt_since_success_ || error.code() == kNotOfTheDriver) throw;
    rebuilt_since_success_ = true;
    log(logger_, LogLevel::kError, std::string("the device failed and is opened anew: ") + error.what());
    uploadOnce(body);
    rebuilt_since_success_ = false;
  }
}

void DeviceHost::uploadOnce(RegisteredBody* body) {
  doOrFault("the CT cannot be put on the device", body, [this, body] {
    // The body gets it back when it is filled, so that none without a CT is left behind whatever is thrown.
    std::unique_ptr<Registrar> registrar = std::move(body->registrar ? body->registrar : spare_);
    const RegistrarOptions options = body->optionsFrom(options_);
    if (!registrar || !registrar->setOptions(options)) registrar = makeRegistrar(options);
    registrar->setVolume(*body->attenuation);
    if (body->rest) registrar->setBodies(*body->rest, body->bodies);
    body->tracker.followBodies(body->bodies.size());
    body->centre_ct_mm = registrar->centreCt();
    body->registrar = std::move(registrar);
  });
}

bool DeviceHost::isReady(RegisteredBody* body) {
  if (body->registrar) return true;
  if (!fault_.empty()) return false;
  try {
    upload(body);
    return true;
  } catch (const DeviceError& error) {
    log(logger_, LogLevel::kError, error.what());
    return false;
  }
}

bool DeviceHost::rebuildAfter(const std::string& failure, RegisteredBody* body) {
  close(body);
  if (rebuilt_since_success_) {
    fault_ = failure;
    log(logger_, LogLevel::kError, "the device failed again: " + failure);
    return false;
  }
  rebuilt_since_success_ = true;
  log(logger_, LogLevel::kError, "the device failed and is opened anew: " + failure);
  try {
    uploadOnce(body);
    return true;
  } catch (const DeviceError& error) {
    fault_ = failure + "; opening the device anew failed: " + error.what();
    log(logger_, LogLevel::kError, fault_);
    return false;
  }
}

void DeviceHost::forgetFault(RegisteredBody* body) {
  if (fault_.empty()) return;
  fault_.clear();
  rebuilt_since_success_ = false;
  close(body);
}

void DeviceHost::setOptions(const RegistrarOptions& options, RegisteredBody* body) {
  options_ = options;
  if (spare_ && !spare_->setOptions(options)) spare_.reset();
  if (!body->registrar || body->registrar->setOptions(body->optionsFrom(options))) return;
  body->registrar.reset();
  upload(body);
}

}  // namespace xray_registration

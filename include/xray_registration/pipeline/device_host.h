#pragma once

#include <functional>
#include <memory>
#include <string>

#include "xray_registration/common/log.h"
#include "xray_registration/pipeline/registered_body.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/registrar_options.h"

namespace xray_registration {

class Device;

/// Owns the device and makes the registrars on it. A device that fails at work is opened anew once; what fails again,
/// or cannot be opened or filled, is a fault, which stays until a CT is uploaded with success or the fault is
/// forgotten. A body's registrar has the body's CT or is null: nothing in between survives an exception. Not
/// thread-safe.
class DeviceHost {
 public:
  using RegistrarFactory = std::function<std::unique_ptr<Registrar>(const RegistrarOptions& options)>;

  /// `device` as Device takes it. Opens nothing yet.
  DeviceHost(std::string device, const RegistrarOptions& options, Logger logger);
  /// The same with another source of registrars.
  DeviceHost(RegistrarFactory factory, const RegistrarOptions& options, Logger logger);

  /// Opens the device and warms it up; nothing when it is open.
  /// @throws DeviceError, which becomes the fault.
  void open();

  /// Puts the body's CT on the device in place of the one before; opens the device when nobody did. A device that fails
  /// meanwhile is opened anew once.
  /// @throws DeviceError, which becomes the fault, for whatever went wrong (memory of the host included).
  void upload(RegisteredBody* body);

  /// Whether the body can be registered. Uploads its CT when the device was closed since; false with a fault.
  bool isReady(RegisteredBody* body);

  /// For a device that failed at work: closes it, opens it anew, and uploads the body's CT. False, with the fault set,
  /// when that was done before without a success since, or does not help.
  bool rebuildAfter(const std::string& failure, RegisteredBody* body);
  /// A frame was registered: the next failure may be answered by a rebuild again.
  void noteSuccess() { rebuilt_since_success_ = false; }

  /// Closes a device at fault, so that the next frame opens it anew.
  void forgetFault(RegisteredBody* body);
  /// Why the device cannot be used; empty when it can, or nobody has tried.
  const std::string& fault() const { return fault_; }

  /// Tuning from the next frame on. A registrar that has to be made anew for it is.
  /// @throws DeviceError as upload does.
  void setOptions(const RegistrarOptions& options, RegisteredBody* body);

  /// Empty while no device is open.
  const std::string& deviceName() const { return device_name_; }

 private:
  std::unique_ptr<Registrar> makeRegistrar(const RegistrarOptions& options);
  void close(RegisteredBody* body);
  void uploadOnce(RegisteredBody* body);
  template <typename Work>
  void doOrFault(const std::string& what_failed, RegisteredBody* body, const Work& work);

  std::string device_choice_;
  RegistrarFactory factory_;  ///< Empty: from the device.
  RegistrarOptions options_;
  Logger logger_;
  std::shared_ptr<Device> device_;
  std::string device_name_;
  std::unique_ptr<Registrar> spare_;  ///< What open() made; the first body takes it.
  std::string fault_;
  bool rebuilt_since_success_ = false;
};

}  // namespace xray_registration

#include <nodelet/nodelet.h>

#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "xray_registration/ros/registration_node.h"

namespace xray_registration {

/// RegistrationNode inside a nodelet manager; images of the same process arrive without a copy.
class RegistrationNodelet : public nodelet::Nodelet {
 private:
  void onInit() override {
    try {
      node_ = std::make_unique<RegistrationNode>(getNodeHandle(), getPrivateNodeHandle());
    } catch (const ParameterError& error) {
      NODELET_FATAL_STREAM(error.what());
      throw;  // The manager then refuses to load.
    }
  }

  std::unique_ptr<RegistrationNode> node_;
};

}  // namespace xray_registration

PLUGINLIB_EXPORT_CLASS(xray_registration::RegistrationNodelet, nodelet::Nodelet)

#include <nodelet/nodelet.h>

#include <exception>
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
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM(onOneLine(error.what()));
      throw;  // The manager goes on without this nodelet and answers that it was not loaded.
    }
  }

  std::unique_ptr<RegistrationNode> node_;
};

}  // namespace xray_registration

PLUGINLIB_EXPORT_CLASS(xray_registration::RegistrationNodelet, nodelet::Nodelet)

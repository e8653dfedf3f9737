#include "xray_registration/ros/transforms.h"

#include <stdexcept>
#include <thread>

#include "xray_registration/ros/conversions.h"

namespace xray_registration {

Transforms::Transforms() : listener_(buffer_, true, ros::TransportHints().tcpNoDelay()) {}

std::optional<RigidTransform> Transforms::lookup(const std::string& target, const std::string& source,
                                                 const ros::Time& stamp, double timeout_s, std::string* why) const {
  if (target == source) return RigidTransform::Identity();
  std::string name = "transform from '";
  name.append(source).append("' to '").append(target).append("'");
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
  while (true) {
    try {
      const geometry_msgs::TransformStamped found = buffer_.lookupTransform(target, source, stamp);
      return fromTransform(found.transform, "the " + name);
    } catch (const std::exception& error) {  // tf2::TransformException and std::invalid_argument
      if (stopped_ || std::chrono::steady_clock::now() >= deadline) {
        *why = "no " + name + ": " + error.what();
        return std::nullopt;
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

}  // namespace xray_registration

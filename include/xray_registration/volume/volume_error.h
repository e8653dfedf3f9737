#pragma once

#include <stdexcept>

namespace xray_registration {

/// What is wrong with a CT, where, and what to do; the message names the file, folder or parameter.
class VolumeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace xray_registration

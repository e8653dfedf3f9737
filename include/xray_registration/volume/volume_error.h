#pragma once

#include "xray_registration/common/escaped.h"

namespace xray_registration {

/// What is wrong with a CT, where, and what to do; the message names the file, folder or parameter.
class VolumeError : public EscapedError {
 public:
  using EscapedError::EscapedError;
};

}  // namespace xray_registration

#pragma once

#include <string>
#include <vector>

#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// What is wrong with a view in itself, in words; empty when nothing is.
std::string problemOf(const XrayFrame& view);

/// What keeps a frame from being registered, in words; empty when nothing does.
std::string problemOf(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start);

}  // namespace xray_registration

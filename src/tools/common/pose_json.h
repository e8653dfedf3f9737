#pragma once

#include <nlohmann/json.hpp>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration::tools {

/// 4×4, a list of rows, mm.
nlohmann::json toJson(const RigidTransform& transform);
RigidTransform rigidFromJson(const nlohmann::json& rows);

/// @throws std::runtime_error naming the file when it cannot be written.
void writeJson(const std::string& path, const nlohmann::json& value);

}  // namespace xray_registration::tools

#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "xray_registration/common/statistics.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/registration/suspicion.h"

namespace xray_registration::tools {

/// 4×4, a list of rows, mm.
nlohmann::json toJson(const RigidTransform& transform);
RigidTransform rigidFromJson(const nlohmann::json& rows);

/// {"median": …, "p95": …, "p99": …}
nlohmann::json toJson(const Percentiles& values);

/// What a registrar suspects: what, in_words, estimate, sigma, unit, effect_mm, certain of each.
nlohmann::json toJson(const std::vector<SetupSuspicion>& suspicions);

/// Infinite numbers and NaN become null, which JSON has in their place.
/// @throws std::runtime_error naming the file when it cannot be written.
void writeJson(const std::string& path, const nlohmann::json& value);

}  // namespace xray_registration::tools

#pragma once

namespace xray_registration {

constexpr double kDegreesPerRadian = 57.29577951308232;

}  // namespace xray_registration

#pragma once

#include "xray_registration/evaluation/trials.h"

namespace xray_registration {

constexpr int kBlackFrames = 20;       ///< That make the CT LOST.
constexpr int kFramesToFindBack = 10;  ///< Offered afterwards, until one is accepted.

/// Loses the CT on purpose: frame `first` is tracked, black frames come, and then the recorded ones from `first` on, in
/// which the CT is `displacement` (about its centre, camera axes) away from where it is believed to be. The trial is
/// the frame that was accepted, or the last one; its start is what was believed.
/// @throws DeviceError as runTrial does; std::runtime_error when the frame before the loss is not accepted.
Trial lostTrial(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames, std::size_t first,
                const Twist& displacement, const Eigen::Vector3d& centre_ct_mm, double target_size_mm);

}  // namespace xray_registration

#pragma once

#include <string>

#include "evaluation/wrong_words.h"
#include "xray_registration/evaluation/wrong_input.h"

namespace xray_registration {

/// Makers of changes to a frame's views. `values` are as many words as the kind takes; `view` names the view that is
/// meant, or is empty.
/// @throws std::invalid_argument for a word that cannot be used; what they return throws it for a view that is missing.

using ChangeViews = WrongInput::ChangeViews;

ChangeViews focalLength(const Strings& values, const std::string& view);
ChangeViews principalPoint(const Strings& values, const std::string& view);
ChangeViews distortion(const Strings& values, const std::string& view);
ChangeViews viewPose(const Strings& values, const std::string& view);
ChangeViews mirroredImage(const Strings& values, const std::string& view);
ChangeViews turnedImage(const Strings& values, const std::string& view);
ChangeViews invertedImage(const Strings& values, const std::string& view);
ChangeViews exchangedViews(const Strings& values, const std::string& view);

}  // namespace xray_registration

#pragma once

#include <functional>
#include <string>
#include <vector>

#include "xray_registration/pipeline/frame_maker.h"
#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// Something that the registration is told wrongly: geometry, side, or patient. Made by changing what a session says,
/// so the truth stays known.
///
/// The truth is the recorded pose of the CT in the first view's camera, whatever is told. What is wrong with a view
/// changes neither the CT nor where it was: pixels that are mirrored or turned are pixels in the wrong place. A CT that
/// was changed has the truth of the right one: its grid's centre and its axes lie where they lay. Shear does not turn
/// it, and bending has no part that is a rigid motion of the body, which would be a truth of its own.
struct WrongInput {
  using ChangeViews = std::function<void(std::vector<RawView>*)>;
  using ChangeCt = std::function<void(Volume*)>;

  std::string text;  ///< As it was given to parseWrongInput.
  /// The suspicion that would be right: focal_length, principal_point, distortion, view_pose, ct_scale, mirrored_image,
  /// turned_image, inverted_image, exchanged_views, mirrored_ct, other_patient.
  std::string what;
  ChangeViews change_views;  ///< Empty when the views are right.
  ChangeCt change_ct;        ///< Empty when the CT is right.
};

/// From "kind", "kind:values" or "kind:values:view"; wrongInputKinds() tells the forms. Without a view all are meant.
/// The same text gives the same change everywhere; what is random has a seed.
/// @throws std::invalid_argument with the text, what is wrong with it, and what is allowed.
WrongInput parseWrongInput(const std::string& text);

/// One line per kind: its form and what is then wrong, for a help text.
std::string wrongInputKinds();

/// Changes a frame's views, in the order of the list.
/// @throws std::invalid_argument for a view that the frame does not have.
void tellWrong(const std::vector<WrongInput>& wrong, std::vector<RawView>* views);

/// Changes the CT, in the order of the list.
/// @throws VolumeError when another CT cannot be read.
void tellWrong(const std::vector<WrongInput>& wrong, Volume* ct);

}  // namespace xray_registration

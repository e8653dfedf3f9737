#include "xray_registration/evaluation/wrong_input.h"

#include <stdexcept>
#include <utility>

#include "evaluation/wrong_ct.h"
#include "evaluation/wrong_views.h"
#include "evaluation/wrong_words.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {
namespace {

using ChangeCt = WrongInput::ChangeCt;

ChangeCt ctScale(const Strings& values) {
  Eigen::Vector3d factors;
  if (values.size() == 2) refuse("two factors are neither one nor three");
  for (std::size_t i = 0; i < 3; ++i) {
    factors[static_cast<int>(i)] = number(values[values.size() == 1 ? 0 : i], "", 0.5, 2.0);
  }
  return [factors](Volume* ct) { *ct = scaled(std::move(*ct), factors); };
}

ChangeCt mirroredCt(const Strings&) {
  return [](Volume* ct) { *ct = mirrored(std::move(*ct)); };
}

ChangeCt shearedCt(const Strings& values) {
  const double shear = number(values[0], "", -0.5, 0.5);
  return [shear](Volume* ct) { *ct = sheared(*ct, shear); };
}

ChangeCt bentCt(const Strings& values) {
  const double largest_mm = number(values[0], "mm", 0.0, 100.0);
  const std::uint64_t seed = seedAt(1, values);
  return [largest_mm, seed](Volume* ct) { *ct = bent(*ct, largest_mm, seed); };
}

ChangeCt otherCt(const Strings& values) {
  const std::string& path = values[0];
  return [path](Volume* ct) { *ct = centredLike(*ct, readVolume(path, {}, {})); };
}

/// One of the two makers is there.
struct Kind {
  std::string name;
  std::string what;
  std::string values;  ///< How they are written; nothing when there are none.
  bool for_a_view;
  Strings::size_type fewest;  ///< Number of values,
  Strings::size_type most;
  ChangeViews (*views)(const Strings& values, const std::string& view);
  ChangeCt (*ct)(const Strings& values);
  std::string meaning;

  std::string form() const { return name + (values.empty() ? "" : ":" + values) + (for_a_view ? "[:VIEW]" : ""); }
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> kKinds = {
      {"focal_length", "focal_length", "FACTOR", true, 1, 1, focalLength, nullptr, "K's focal lengths times FACTOR"},
      {"principal_point", "principal_point", "X,Y", true, 2, 2, principalPoint, nullptr,
       "K's principal point moved by X, Y px"},
      {"distortion", "distortion", "K1|s_shape,PX", true, 1, 2, distortion, nullptr,
       "the image has a distortion that D does not say: radial, or S-shaped by PX at half its width"},
      {"view_pose", "view_pose", "DEG,MM[,seedN|,AXIS,AXIS]", true, 2, 4, viewPose, nullptr,
       "a further view (the second) turned by DEG about its source and moved by MM, both in its own axes: about and "
       "along x, y or z, or directions from a seed"},
      {"ct_scale", "ct_scale", "FACTOR|X,Y,Z", false, 1, 3, nullptr, ctScale,
       "the CT too large about its centre, along the patient's axes"},
      {"mirrored_image", "mirrored_image", "left_right|up_down", true, 1, 1, mirroredImage, nullptr,
       "the pixels mirrored"},
      {"turned_image", "turned_image", "90|180|270", true, 1, 1, turnedImage, nullptr, "the pixels turned clockwise"},
      {"inverted_image", "inverted_image", "", true, 0, 0, invertedImage, nullptr, "bright and dark exchanged"},
      {"exchanged_views", "exchanged_views", "", false, 0, 0, exchangedViews, nullptr,
       "the first two views' images exchanged"},
      {"mirrored_ct", "mirrored_ct", "", false, 0, 0, nullptr, mirroredCt,
       "left and right of the patient exchanged, about the CT's centre"},
      {"sheared_ct", "other_patient", "SHEAR", false, 1, 1, nullptr, shearedCt,
       "the CT sheared in the patient's x-z plane, without turning"},
      {"bent_ct", "other_patient", "MM[,seedN]", false, 1, 2, nullptr, bentCt,
       "the CT bent smoothly, no point of the body by more than MM, without turning or moving it"},
      {"other_ct", "other_patient", "PATH", false, 1, 1, nullptr, otherCt,
       "another CT, its centre where the right one's lies"},
  };
  return kKinds;
}

const Kind& kindNamed(const std::string& name) {
  Strings names;
  for (const Kind& kind : kinds()) {
    if (kind.name == name) return kind;
    names.push_back(kind.name);
  }
  refuse("'" + name + "' is no kind; allowed: " + joined(names));
}

/// What stands behind the kind's name.
struct Words {
  Strings values;
  Strings view;  ///< One word at most.
};

Words wordsOf(const Kind& kind, const std::string& text) {
  const std::string words = text.size() > kind.name.size() ? text.substr(kind.name.size() + 1) : "";
  if (kind.ct == otherCt) return {words.empty() ? Strings{} : Strings{words}, {}};  // Paths hold any character.
  Words found{{}, splitAt(':', words)};
  if (!kind.values.empty() && !found.view.empty()) {
    found.values = splitAt(',', found.view.front());
    found.view.erase(found.view.begin());
  }
  return found;
}

WrongInput make(const Kind& kind, const std::string& text) {
  const auto [values, view] = wordsOf(kind, text);
  if (values.size() < kind.fewest || values.size() > kind.most) {
    refuse("a number of values that is not allowed (" + std::to_string(values.size()) + ")");
  }
  if (view.size() > (kind.for_a_view ? 1U : 0U)) refuse("'" + view.back() + "' is too much");
  WrongInput wrong{text, kind.what, {}, {}};
  if (kind.views != nullptr) wrong.change_views = kind.views(values, view.empty() ? "" : view.front());
  if (kind.ct != nullptr) wrong.change_ct = kind.ct(values);
  return wrong;
}

}  // namespace

WrongInput parseWrongInput(const std::string& text) {
  std::string allowed;
  try {
    const Kind& kind = kindNamed(text.substr(0, text.find(':')));
    allowed = "; allowed: " + kind.form();
    return make(kind, text);
  } catch (const std::invalid_argument& error) {
    refuse("wrong input '" + text + "': " + error.what() + allowed);
  }
}

std::string wrongInputKinds() {
  std::string text;
  for (const Kind& kind : kinds()) text += "  " + kind.form() + "  " + kind.meaning + "\n";
  return text;
}

void tellWrong(const std::vector<WrongInput>& wrong, std::vector<RawView>* views) {
  for (const WrongInput& one : wrong) {
    try {
      if (one.change_views) one.change_views(views);
    } catch (const std::invalid_argument& error) {
      refuse("wrong input '" + one.text + "': " + error.what());
    }
  }
}

void tellWrong(const std::vector<WrongInput>& wrong, Volume* ct) {
  for (const WrongInput& one : wrong) {
    if (one.change_ct) one.change_ct(ct);
  }
}

}  // namespace xray_registration

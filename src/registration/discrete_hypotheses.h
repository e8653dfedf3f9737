#pragma once

#include <array>
#include <string>
#include <vector>

#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// A frame and where to start in it, as they would have come if what was told had been right.
struct PutRight {
  std::vector<ViewInput> views;
  RigidTransform T_camera_ct_start = RigidTransform::Identity();
};

/// Something that is either right or wrong about a frame: its side, its orientation, the order of its views.
struct DiscreteHypothesis {
  std::string what;      ///< The interface's word, "mirrored_image".
  std::string in_words;  ///< "the X-ray of the view 'ap' looks mirrored left to right"
  std::string remedy;
  bool keeps_likeness = false;  ///< A body that looks nearly the same that way exists; else it is worth asking only
                                ///< when nothing was found.
};

/// Two poses from which the CT looks nearly as from this one in a mirror that exchanges left and right of the image:
/// from behind, and, of a CT whose left and right are alike, from its other side.
std::array<RigidTransform, 2> otherSides(const RigidTransform& T_camera_ct, const XrayCamera& camera,
                                         const Eigen::Vector3d& centre_ct_mm);

/// What can be asked of so many views.
class DiscreteHypotheses {
 public:
  explicit DiscreteHypotheses(const std::vector<std::string>& view_names);
  const std::vector<DiscreteHypothesis>& all() const { return all_; }
  /// The frame with hypothesis `index` put right. Its images are copied: give small ones. What was found in the frame
  /// as it was told may be where the CT looks so from the wrong side, and then says where the right one is.
  PutRight putRight(std::size_t index, const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start,
                    const RigidTransform& T_camera_ct_found, const Eigen::Vector3d& centre_ct_mm) const;

 private:
  enum class Kind { kMirrored, kTurned, kInverted, kExchanged, kMirroredCt };
  enum class Start {
    kAsTold,
    kFromBehind,  ///< Any body from behind looks mirrored, nearly;
    kInMirror,    ///< and one whose left and right are alike looks so from its other side.
  };
  struct Change {
    Kind kind;
    int quarter_turns = 0;           ///< Clockwise, before a reflection left to right.
    std::vector<std::size_t> views;  ///< That are changed.
    Start start = Start::kAsTold;
  };
  void add(const DiscreteHypothesis& hypothesis, const Change& change);

  std::vector<DiscreteHypothesis> all_;
  std::vector<Change> changes_;
};

}  // namespace xray_registration

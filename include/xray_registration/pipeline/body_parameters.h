#pragma once

#include <optional>
#include <string>
#include <vector>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// One entry of the list `bodies`: a structure with a pose of its own. It comes from exactly one source: labels of
/// ct/mask (as numbers and as names of segments), a CT of its own, or a mesh.
struct BodyParameters {
  std::string name;                      ///< Of its topics, and in messages; a segment of a ROS name.
  std::vector<int> labels;               ///< label, labels: numbers, …
  std::vector<std::string> label_names;  ///< … and names, as a .seg.nrrd holds them.
  std::string ct;                        ///< A file or folder as ct/path.
  std::string mesh;                      ///< STL, PLY or VTK, mm.
  /// Of a mesh, 1/mm. The default is a little less than titanium's at 60 keV (0.34), as the beam hardens in metal;
  /// cobalt-chromium has some 1. Behind either a detector is mostly saturated, and the outline is what counts.
  double attenuation_per_mm = 0.25;
  std::string frame;  ///< tf frame; empty until parsing, which takes the name.
  /// max_rotation and max_translation: how far from where the CT says that the body is (or from its initial pose) it is
  /// searched for and accepted. On the wrist's bones ±22 mm ended on neighbours.
  double max_rotation_rad = 0.3;
  double max_translation_mm = 10.0;
  std::optional<RigidTransform> initial_pose;  ///< Of the body's own frame in the first view's camera, mm.

  bool isCutFromCt() const { return !labels.empty() || !label_names.empty(); }
};

}  // namespace xray_registration

#pragma once

#include <optional>
#include <vector>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// Where a CT is searched for.
struct WideSearchRange {
  /// The middle of the search, in the first view's camera; none: nothing is known, and the usual views of a patient are
  /// searched, with the CT's centre anywhere in the first view's image.
  std::optional<RigidTransform> T_camera_ct_centre;
  double rotation_rad = 0.0;    ///< Half range about the centre, any axis.
  double translation_mm = 0.0;  ///< Half range of each component of the CT's centre, camera axes.
  double nearest_mm = 450.0;    ///< Without a centre: the CT's centre lies so far from the first view's source,
  double farthest_mm = 1100.0;  ///< at least and at most, along the optical axis.
};

/// A search far from any start, in slices: whoever runs it can stop, or do something else in between. DRRs of all
/// orientations are compared with small X-rays at all shifts; the best are refined on coarse levels, side by side. What
/// it gives are places to start from: registerAmong says which of them is right, if any. It keeps the frame's X-rays,
/// stands on the registrar that made it, and ends with that one's CT. Not thread-safe.
class WideSearch {
 public:
  virtual ~WideSearch() = default;

  /// Does one slice, some tens of milliseconds. False when nothing is left to do. @throws DeviceError.
  virtual bool advance() = 0;

  virtual double progress() const = 0;        ///< 0 … 1, by work.
  virtual double bestSimilarity() const = 0;  ///< Of what was found so far, −1…1.

  /// The first view's camera; best first, at different places. Empty until advance() has returned false.
  virtual const std::vector<RigidTransform>& places() const = 0;
};

}  // namespace xray_registration

#pragma once

#include <vector>

#include "mesh_repair.h"

namespace xray_registration {

/// Where a line parallel to x is inside a solid: from, to, in mm.
struct Span {
  double from;
  double to;
};

/// Cuts a closed surface by planes of constant z and these by lines of constant y. A point on a plane or a line counts
/// as below it, everywhere alike, and an edge's crossing is computed the same way for both of its triangles, so that
/// every line enters as often as it leaves.
class MeshSlice {
 public:
  /// Of the triangles numbered in `candidates`; others must not reach z.
  MeshSlice(const ClosedSurface& surface, const std::vector<std::uint32_t>& candidates, double z);

  /// The solid's spans on a line, in order and disjoint.
  std::vector<Span> spansAt(double y) const;

  /// Extent of the section in y; low > high when it is empty.
  double lowY() const { return low_y_; }
  double highY() const { return high_y_; }

 private:
  struct Point {
    double x;
    double y;
  };
  struct Segment {
    Point from;
    Point to;
  };

  void addSegment(const SurfaceMesh& mesh, const std::array<std::uint32_t, 3>& triangle, double z);

  std::vector<Segment> segments_;
  bool is_oriented_;
  double low_y_;
  double high_y_;
};

}  // namespace xray_registration

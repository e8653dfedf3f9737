#include "mesh_scanline.h"

#include <algorithm>
#include <limits>

namespace xray_registration {

MeshSlice::MeshSlice(const ClosedSurface& surface, const std::vector<std::uint32_t>& candidates, double z)
    : is_oriented_(surface.is_oriented),
      low_y_(std::numeric_limits<double>::max()),
      high_y_(std::numeric_limits<double>::lowest()) {
  for (const std::uint32_t t : candidates) addSegment(surface.mesh, surface.mesh.triangles[t], z);
}

void MeshSlice::addSegment(const SurfaceMesh& mesh, const std::array<std::uint32_t, 3>& triangle, double z) {
  // Two edges cross the plane: one on the way up, where the segment begins, and one on the way down.
  Segment segment{};
  bool crosses = false;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t from = triangle[i];
    const std::uint32_t to = triangle[(i + 1) % 3];
    const bool from_above = mesh.points_mm[from].z() > z;
    if (from_above == (mesh.points_mm[to].z() > z)) continue;
    crosses = true;
    const Eigen::Vector3d low = mesh.points_mm[std::min(from, to)].cast<double>();
    const Eigen::Vector3d high = mesh.points_mm[std::max(from, to)].cast<double>();
    const double share = (z - low.z()) / (high.z() - low.z());
    const Point crossing = {low.x() + share * (high.x() - low.x()), low.y() + share * (high.y() - low.y())};
    (from_above ? segment.to : segment.from) = crossing;
    low_y_ = std::min(low_y_, crossing.y);
    high_y_ = std::max(high_y_, crossing.y);
  }
  if (crosses) segments_.push_back(segment);
}

std::vector<Span> MeshSlice::spansAt(double y) const {
  struct Crossing {
    double x;
    int winding;
  };
  std::vector<Crossing> crossings;
  for (const Segment& segment : segments_) {
    const bool from_above = segment.from.y > y;
    if (from_above == (segment.to.y > y)) continue;
    // From the lower end, so that the direction of the segment does not matter to the last bit.
    const Point& low = from_above ? segment.to : segment.from;
    const Point& high = from_above ? segment.from : segment.to;
    crossings.push_back({low.x + (y - low.y) / (high.y - low.y) * (high.x - low.x), from_above ? -1 : 1});
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) { return a.x < b.x; });
  std::vector<Span> spans;
  int winding = 0;
  for (const Crossing& crossing : crossings) {
    const bool was_inside = winding != 0;
    winding = is_oriented_ ? winding + crossing.winding : 1 - winding;
    if (!was_inside && winding != 0) spans.push_back({crossing.x, crossing.x});
    if (was_inside && winding == 0) spans.back().to = crossing.x;
  }
  return spans;
}

}  // namespace xray_registration

#include "mesh_repair.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <sstream>
#include <tuple>

#include "mesh_readers.h"

namespace xray_registration {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

// How a triangle runs along an edge.
struct EdgeUse {
  std::uint32_t low;
  std::uint32_t high;
  std::uint32_t triangle;
  bool upwards;  // From the lower to the higher index.
};

bool sameEdge(const EdgeUse& a, const EdgeUse& b) { return a.low == b.low && a.high == b.high; }

std::vector<EdgeUse> edgesOf(const std::vector<Triangle>& triangles) {
  std::vector<EdgeUse> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = triangles[t][i];
      const std::uint32_t to = triangles[t][(i + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), t, from < to});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

// Calls visit(first, last) for the uses of each edge.
template <typename Visit>
void forEachEdge(const std::vector<EdgeUse>& edges, const Visit& visit) {
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin + 1;
    while (end < edges.size() && sameEdge(edges[begin], edges[end])) ++end;
    visit(begin, end);
    begin = end;
  }
}

struct OpenEdges {
  std::size_t count = 0;
  EdgeUse first{};
};

OpenEdges openEdgesOf(const std::vector<Triangle>& triangles) {
  const std::vector<EdgeUse> edges = edgesOf(triangles);
  OpenEdges open;
  forEachEdge(edges, [&](std::size_t begin, std::size_t end) {
    if ((end - begin) % 2 == 0) return;
    if (open.count++ == 0) open.first = edges[begin];
  });
  return open;
}

Triangle sorted(Triangle triangle) {
  std::sort(triangle.begin(), triangle.end());
  return triangle;
}

// Whether the corners are an even permutation of their order.
bool isEven(const Triangle& t) { return (t[0] < t[1]) == ((t[1] < t[2]) == (t[0] < t[2])); }

// Each triangle once. A triangle that is there with both sides is written twice, or is a fold without thickness, which
// bounds nothing: `drop_folds`.
std::vector<Triangle> withoutDuplicates(std::vector<Triangle> triangles, bool drop_folds) {
  std::stable_sort(triangles.begin(), triangles.end(),
                   [](const Triangle& a, const Triangle& b) { return sorted(a) < sorted(b); });
  std::vector<Triangle> kept;
  kept.reserve(triangles.size());
  for (auto first = triangles.begin(); first != triangles.end();) {
    auto last = first;
    bool has_both = false;
    for (; last != triangles.end() && sorted(*last) == sorted(*first); ++last) {
      has_both = has_both || isEven(*last) != isEven(*first);
    }
    if (!(has_both && drop_folds)) kept.push_back(*first);
    first = last;
  }
  return kept;
}

// Turns triangles so that those which share an edge run along it in opposite directions, shell by shell.
class Orienter {
 public:
  explicit Orienter(SurfaceMesh* mesh) : mesh_(mesh), neighbours_(mesh->triangles.size()) {
    const std::vector<EdgeUse> edges = edgesOf(mesh->triangles);
    forEachEdge(edges, [&](std::size_t begin, std::size_t end) {
      if (end - begin != 2) return;  // Shells touch here; which belongs to which is not known.
      const EdgeUse& a = edges[begin];
      const EdgeUse& b = edges[begin + 1];
      neighbours_[a.triangle].push_back({b.triangle, a.upwards == b.upwards});
      neighbours_[b.triangle].push_back({a.triangle, a.upwards == b.upwards});
    });
  }

  void orient() {
    visited_.assign(neighbours_.size(), false);
    flipped_.assign(neighbours_.size(), false);
    for (std::uint32_t seed = 0; seed < neighbours_.size(); ++seed) {
      if (!visited_[seed]) orientShell(seed);
    }
  }

 private:
  struct Neighbour {
    std::uint32_t triangle;
    bool disagrees;
  };

  void orientShell(std::uint32_t seed) {
    std::vector<std::uint32_t> shell = {seed};
    visited_[seed] = true;
    bool agreed = true;
    for (std::size_t i = 0; i < shell.size(); ++i) {
      const std::uint32_t here = shell[i];
      for (const Neighbour& next : neighbours_[here]) {
        agreed = agreed && !next.disagrees;
        if (visited_[next.triangle]) continue;
        visited_[next.triangle] = true;
        flipped_[next.triangle] = flipped_[here] != next.disagrees;
        shell.push_back(next.triangle);
      }
    }
    if (agreed) return;
    double volume = 0.0;
    for (const std::uint32_t t : shell) {
      if (flipped_[t]) std::swap(mesh_->triangles[t][1], mesh_->triangles[t][2]);
      volume += tetrahedron(t);
    }
    if (volume >= 0.0) return;
    for (const std::uint32_t t : shell) std::swap(mesh_->triangles[t][1], mesh_->triangles[t][2]);
  }

  double tetrahedron(std::uint32_t t) const {
    const auto corner = [&](std::size_t i) { return mesh_->points_mm[mesh_->triangles[t][i]].cast<double>().eval(); };
    return corner(0).dot(corner(1).cross(corner(2))) / 6.0;
  }

  SurfaceMesh* mesh_;
  std::vector<std::vector<Neighbour>> neighbours_;
  std::vector<bool> visited_;
  std::vector<bool> flipped_;
};

bool isBalanced(const std::vector<Triangle>& triangles) {
  const std::vector<EdgeUse> edges = edgesOf(triangles);
  bool balanced = true;
  forEachEdge(edges, [&](std::size_t begin, std::size_t end) {
    const auto up =
        std::count_if(edges.begin() + static_cast<std::ptrdiff_t>(begin),
                      edges.begin() + static_cast<std::ptrdiff_t>(end), [](const EdgeUse& use) { return use.upwards; });
    balanced = balanced && 2 * static_cast<std::size_t>(up) == end - begin;
  });
  return balanced;
}

[[noreturn]] void refuseOpen(const SurfaceMesh& mesh, const OpenEdges& open, const std::string& name) {
  const Eigen::Vector3f middle = 0.5F * (mesh.points_mm[open.first.low] + mesh.points_mm[open.first.high]);
  std::ostringstream text;
  text << "its surface is not closed, so it has no inside: " << open.count
       << (open.count == 1 ? " edge lacks" : " edges lack") << " a neighbour, the first near (" << middle.x() << ", "
       << middle.y() << ", " << middle.z() << ") mm; close its holes (MeshLab: Filters, Remeshing, Close Holes)";
  refuseMesh(name, text.str());
}

}  // namespace

SurfaceMesh withMergedPoints(const SurfaceMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.points_mm.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&mesh](std::uint32_t i) {
    const Eigen::Vector3f& p = mesh.points_mm[i];
    return std::make_tuple(p.x(), p.y(), p.z());
  };
  std::sort(order.begin(), order.end(),
            [&key](std::uint32_t a, std::uint32_t b) { return std::make_pair(key(a), a) < std::make_pair(key(b), b); });
  SurfaceMesh merged;
  std::vector<std::uint32_t> new_index(mesh.points_mm.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || key(order[i]) != key(order[i - 1])) merged.points_mm.push_back(mesh.points_mm[order[i]]);
    new_index[order[i]] = static_cast<std::uint32_t>(merged.points_mm.size() - 1);
  }
  merged.triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Triangle now = {new_index[t[0]], new_index[t[1]], new_index[t[2]]};
    if (now[0] != now[1] && now[1] != now[2] && now[2] != now[0]) merged.triangles.push_back(now);
  }
  return merged;
}

ClosedSurface closedSurface(const SurfaceMesh& mesh, const std::string& name) {
  const SurfaceMesh merged = withMergedPoints(mesh);
  if (merged.triangles.empty()) refuseMesh(name, "it holds no triangles");
  ClosedSurface surface;
  surface.mesh.points_mm = merged.points_mm;
  surface.mesh.triangles = withoutDuplicates(merged.triangles, false);
  const OpenEdges open = openEdgesOf(surface.mesh.triangles);
  if (open.count > 0) {
    surface.mesh.triangles = withoutDuplicates(merged.triangles, true);
    if (surface.mesh.triangles.empty() || openEdgesOf(surface.mesh.triangles).count > 0) refuseOpen(merged, open, name);
  }
  Orienter(&surface.mesh).orient();
  surface.is_oriented = isBalanced(surface.mesh.triangles);
  return surface;
}

double signedVolume(const SurfaceMesh& mesh) {
  double volume = 0.0;
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.points_mm[t[0]].cast<double>();
    const Eigen::Vector3d b = mesh.points_mm[t[1]].cast<double>();
    volume += a.dot(b.cross(mesh.points_mm[t[2]].cast<double>())) / 6.0;
  }
  return volume;
}

}  // namespace xray_registration

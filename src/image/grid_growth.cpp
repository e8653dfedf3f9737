#include "image/grid_growth.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <opencv2/flann.hpp>
#include <optional>
#include <set>
#include <utility>

#include "xray_registration/common/statistics.h"

namespace xray_registration {
namespace grid_detail {
namespace {

/// A spot belongs to a cell when it lies within this share of a step of where it is expected.
constexpr double kReach = 0.25;
/// A node further than this share of a step from the middle between its neighbours is none.
constexpr double kLargestDeviation = 0.12;
/// Spots in the middle that are tried as starts, and starts that link anything.
constexpr std::size_t kSpotsToStartFrom = 60;
constexpr int kStarts = 6;
constexpr std::size_t kNeighbours = 9;
/// How much a cell's own neighbours count against the steps that it was found by.
constexpr double kPriorWeight = 0.5;
constexpr int kSurroundings = 2;
/// Nodes from the middle that its steps are taken from.
constexpr std::size_t kNodesOfTheMiddle = 30;

const std::array<Eigen::Vector2i, 4> kDirections = {Eigen::Vector2i(1, 0), Eigen::Vector2i(0, 1), Eigen::Vector2i(1, 1),
                                                    Eigen::Vector2i(1, -1)};

/// The spots nearest to a place.
class Spots {
 public:
  explicit Spots(const std::vector<Spot>& spots) : spots_(spots) {
    places_.create(static_cast<int>(spots.size()), 2);
    for (int i = 0; i < places_.rows; ++i) {
      places_(i, 0) = static_cast<float>(spots[static_cast<std::size_t>(i)].pixel.x());
      places_(i, 1) = static_cast<float>(spots[static_cast<std::size_t>(i)].pixel.y());
    }
    tree_ = std::make_unique<Tree>(places_, cvflann::KDTreeSingleIndexParams());
  }

  const Eigen::Vector2d& at(std::size_t spot) const { return spots_[spot].pixel; }
  double contrastOf(std::size_t spot) const { return spots_[spot].contrast; }

  /// From near to far.
  std::vector<std::size_t> nearest(const Eigen::Vector2d& place, std::size_t count) const {
    count = std::min(count, spots_.size());
    std::vector<int> indices(count);
    std::vector<float> squares(count);
    const std::vector<float> query = {static_cast<float>(place.x()), static_cast<float>(place.y())};
    tree_->knnSearch(query, indices, squares, static_cast<int>(count), cvflann::SearchParams(-1));
    return std::vector<std::size_t>(indices.begin(), indices.end());
  }

  std::optional<std::size_t> within(const Eigen::Vector2d& place, double distance) const {
    const std::size_t spot = nearest(place, 1).front();
    if ((at(spot) - place).norm() > distance) return std::nullopt;
    return spot;
  }

 private:
  using Tree = cv::flann::GenericIndex<cvflann::L2<float>>;
  const std::vector<Spot>& spots_;
  cv::Mat_<float> places_;
  std::unique_ptr<Tree> tree_;
};

double shorterStep(const Eigen::Matrix2d& steps) { return std::min(steps.col(0).norm(), steps.col(1).norm()); }

/// Steps from a spot to two neighbours that lie in clearly different directions and have a counterpart opposite.
std::optional<Eigen::Matrix2d> stepsAt(const Spots& spots, std::size_t start) {
  const Eigen::Vector2d& place = spots.at(start);
  std::vector<Eigen::Vector2d> to;
  for (const std::size_t spot : spots.nearest(place, kNeighbours)) {
    if (spot != start) to.push_back(spots.at(spot) - place);
  }
  for (std::size_t i = 1; i < to.size(); ++i) {
    const double cosine = to[0].dot(to[i]) / (to[0].norm() * to[i].norm());
    if (std::abs(cosine) > 0.64 || to[i].norm() > 1.6 * to[0].norm()) continue;
    Eigen::Matrix2d steps;
    steps << to[0], to[i];
    const double reach = kReach * to[0].norm();
    if (spots.within(place - to[0], reach) && spots.within(place - to[i], reach)) return steps;
  }
  return std::nullopt;
}

struct CellOrder {
  bool operator()(const Eigen::Vector2i& a, const Eigen::Vector2i& b) const {
    return std::make_pair(a.x(), a.y()) < std::make_pair(b.x(), b.y());
  }
};
using Cells = std::map<Eigen::Vector2i, Eigen::Vector2d, CellOrder>;

class Growth {
 public:
  explicit Growth(const Spots& spots) : spots_(spots) {}

  std::vector<Node> from(std::size_t start, const Eigen::Matrix2d& steps) {
    link(Eigen::Vector2i::Zero(), start, steps);
    while (!pending_.empty()) {
      const auto [cell, given_steps] = pending_.front();
      pending_.pop_front();
      lookAround(cell, stepsFrom(cell, given_steps));
    }
    return nodes_;
  }

 private:
  void link(const Eigen::Vector2i& cell, std::size_t spot, const Eigen::Matrix2d& steps) {
    cells_[cell] = spots_.at(spot);
    taken_.insert(spot);
    nodes_.push_back({cell, spots_.at(spot), spots_.contrastOf(spot)});
    pending_.emplace_back(cell, steps);
  }

  /// Least squares over what is linked around the cell; the given steps keep it determined.
  Eigen::Matrix2d stepsFrom(const Eigen::Vector2i& cell, const Eigen::Matrix2d& given) const {
    Eigen::Matrix2d moves = kPriorWeight * given;
    Eigen::Matrix2d cells = kPriorWeight * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d& place = cells_.at(cell);
    for (int i = -kSurroundings; i <= kSurroundings; ++i) {
      for (int j = -kSurroundings; j <= kSurroundings; ++j) {
        const auto other = cells_.find(cell + Eigen::Vector2i(i, j));
        if (other == cells_.end()) continue;
        const Eigen::Vector2d offset(i, j);
        moves += (other->second - place) * offset.transpose();
        cells += offset * offset.transpose();
      }
    }
    return moves * cells.inverse();
  }

  void lookAround(const Eigen::Vector2i& cell, const Eigen::Matrix2d& steps) {
    const Eigen::Vector2d place = cells_.at(cell);
    for (const Eigen::Vector2i& direction : kDirections) {
      for (const int sign : {1, -1}) {
        const Eigen::Vector2i next = cell + sign * direction;
        if (cells_.count(next) != 0) continue;
        const Eigen::Vector2d expected = place + steps * (sign * direction).cast<double>();
        const auto spot = spots_.within(expected, kReach * shorterStep(steps));
        if (spot && taken_.count(*spot) == 0) link(next, *spot, steps);
      }
    }
  }

  const Spots& spots_;
  Cells cells_;
  std::set<std::size_t> taken_;
  std::vector<Node> nodes_;
  std::deque<std::pair<Eigen::Vector2i, Eigen::Matrix2d>> pending_;
};

/// Distance of each node from the middle between neighbours on both sides, median over the directions in which it has
/// both; negative for nodes that have none.
std::vector<double> deviations(const std::vector<Node>& nodes) {
  Cells cells;
  for (const Node& node : nodes) cells[node.cell] = node.pixel;
  std::vector<double> result;
  for (const Node& node : nodes) {
    std::vector<double> lengths;
    for (const Eigen::Vector2i& direction : kDirections) {
      const auto before = cells.find(node.cell - direction);
      const auto after = cells.find(node.cell + direction);
      if (before == cells.end() || after == cells.end()) continue;
      lengths.push_back((node.pixel - 0.5 * (before->second + after->second)).norm());
    }
    result.push_back(lengths.empty() ? -1.0 : median(lengths));
  }
  return result;
}

/// Leaves out what does not lie between its neighbours, and says how regular the rest is.
Lattice checked(std::vector<Node> nodes, const Eigen::Matrix2d& steps) {
  const std::vector<double> deviation = deviations(nodes);
  Lattice lattice;
  std::vector<double> of_regular;
  std::vector<double> contrasts;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (deviation[i] > kLargestDeviation * shorterStep(steps)) continue;
    if (deviation[i] >= 0.0) of_regular.push_back(deviation[i]);
    contrasts.push_back(nodes[i].contrast);
    lattice.nodes.push_back(nodes[i]);
  }
  lattice.roughness_px = median(of_regular);
  lattice.contrast = median(contrasts);
  lattice.steps = steps;
  return lattice;
}

/// Steps by least squares over the nodes nearest to the middle.
Eigen::Matrix2d stepsInTheMiddle(const std::vector<Node>& nodes) {
  const auto count = static_cast<Eigen::Index>(std::min(nodes.size(), kNodesOfTheMiddle));
  Eigen::Matrix2Xd cells(2, count);
  Eigen::Matrix2Xd pixels(2, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    cells.col(i) = nodes[static_cast<std::size_t>(i)].cell.cast<double>();
    pixels.col(i) = nodes[static_cast<std::size_t>(i)].pixel;
  }
  cells.colwise() -= cells.rowwise().mean().eval();
  pixels.colwise() -= pixels.rowwise().mean().eval();
  return pixels * cells.transpose() * (cells * cells.transpose()).inverse();
}

}  // namespace

Lattice grownLattice(const std::vector<Spot>& spots, const Eigen::Vector2d& middle) {
  if (spots.size() < kNeighbours) return {};
  const Spots near(spots);
  std::vector<Node> best;
  Eigen::Matrix2d best_steps = Eigen::Matrix2d::Identity();
  int starts = 0;
  for (const std::size_t start : near.nearest(middle, kSpotsToStartFrom)) {
    const auto steps = stepsAt(near, start);
    if (!steps) continue;
    std::vector<Node> nodes = Growth(near).from(start, *steps);
    if (nodes.size() > best.size()) {
      best = std::move(nodes);
      best_steps = *steps;
    }
    if (++starts == kStarts) break;
  }
  Lattice lattice = checked(std::move(best), best_steps);
  if (lattice.nodes.size() >= kNeighbours) lattice.steps = stepsInTheMiddle(lattice.nodes);
  return lattice;
}

}  // namespace grid_detail
}  // namespace xray_registration

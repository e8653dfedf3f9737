#pragma once

#include <Eigen/Core>
#include <vector>

#include "image/grid_blobs.h"

// Gives scattered spots their places in a grid. Private to this room.
namespace xray_registration {
namespace grid_detail {

struct Node {
  Eigen::Vector2i cell;
  Eigen::Vector2d pixel;
  double contrast = 0.0;
};

/// Spots that follow each other regularly.
struct Lattice {
  std::vector<Node> nodes;  ///< In the order in which they were found, from the middle outwards.
  Eigen::Matrix2d steps = Eigen::Matrix2d::Zero();  ///< Columns: from a cell to the next, in the middle; pixels.
  double contrast = 0.0;                            ///< Of the nodes, median.
  double roughness_px = 0.0;  ///< How far nodes lie from the middle between their neighbours, median.
};

/// Grows a lattice from the spots nearest to `middle`: what is already linked predicts where each next one must be, so
/// that steps may change slowly over the picture. Of several starts the one that links most. Empty when nothing links.
Lattice grownLattice(const std::vector<Spot>& spots, const Eigen::Vector2d& middle);

}  // namespace grid_detail
}  // namespace xray_registration

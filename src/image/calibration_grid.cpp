#include "xray_registration/image/calibration_grid.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <sstream>
#include <string>

#include "image/grid_blobs.h"
#include "image/grid_growth.h"
#include "image/mask_common.h"
#include "image/polynomial_surface.h"

namespace xray_registration {
namespace {

using grid_detail::Lattice;
using grid_detail::Node;

constexpr double kPi = 3.14159265358979323846;
/// Fewer marks tell nothing about a distortion.
constexpr std::size_t kFewestMarks = 30;
/// More spots are grain, and would take minutes.
constexpr std::size_t kMostSpots = 50000;
/// Of the picture: a smaller grid is none that was put there for the whole field.
constexpr double kLeastCovered = 0.1;
/// Spots at random link here and there; a grid fills the area that it covers.
constexpr double kLeastFilled = 0.6;
/// Of a step: marks of a grid lie between their neighbours more exactly than this.
constexpr double kRoughest = 0.05;
/// Scales of the spots that are looked for.
constexpr double kSmallestSpot_px = 1.2;
constexpr double kSpotsPerSide = 28.0;
constexpr double kScaleStep = 1.4142135623730951;
/// A grid found at one scale shows the same as another that covers so much of its area: of a coarse grid a larger scale
/// loses a row at each border.
constexpr double kSameArea = 0.5;
/// How far cells in the middle of the picture may be from a square or a regular triangle pair.
constexpr double kLargestSideRatio = 1.12;
constexpr double kAngleTolerance_deg = 12.0;

template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  throw GridError(text.str());
}

struct Candidate {
  Lattice lattice;
  bool bright = false;
  double filled_share = 0.0;
  double covered_share = 0.0;  ///< Of the picture.
};

double areaOf(const std::vector<Node>& nodes) {
  std::vector<cv::Point2f> places;
  places.reserve(nodes.size());
  for (const Node& node : nodes) places.emplace_back(cv::Point2d(node.pixel.x(), node.pixel.y()));
  std::vector<cv::Point2f> hull;
  cv::convexHull(places, hull);
  return cv::contourArea(hull);
}

bool isGrid(const Candidate& candidate) {
  const Eigen::Matrix2d& steps = candidate.lattice.steps;
  const double step = std::min(steps.col(0).norm(), steps.col(1).norm());
  return candidate.lattice.nodes.size() >= kFewestMarks && candidate.filled_share >= kLeastFilled &&
         candidate.covered_share >= kLeastCovered && candidate.lattice.roughness_px <= kRoughest * step;
}

Candidate candidateOf(const std::vector<grid_detail::Spot>& spots, const cv::Size& size) {
  Candidate candidate;
  if (spots.size() > kMostSpots) return candidate;
  candidate.lattice =
      grid_detail::grownLattice(spots, Eigen::Vector2d(0.5 * (size.width - 1), 0.5 * (size.height - 1)));
  if (candidate.lattice.nodes.size() < kFewestMarks) return candidate;
  const double area = areaOf(candidate.lattice.nodes);
  const double cell = std::abs(candidate.lattice.steps.determinant());
  if (area > 0.0) candidate.filled_share = static_cast<double>(candidate.lattice.nodes.size()) * cell / area;
  candidate.covered_share = area / size.area();
  return candidate;
}

/// What each scale and polarity takes for a grid.
std::vector<Candidate> candidatesIn(const cv::Mat& picture) {
  const double largest = std::min(picture.cols, picture.rows) / kSpotsPerSide;
  std::vector<Candidate> candidates;
  for (double sigma = kSmallestSpot_px; sigma <= largest; sigma *= kScaleStep) {
    const auto scaled = grid_detail::atScale(picture, sigma);
    for (const auto polarity : {grid_detail::Polarity::kBright, grid_detail::Polarity::kDark}) {
      candidates.push_back(candidateOf(grid_detail::spotsOf(scaled, polarity), picture.size()));
      candidates.back().bright = polarity == grid_detail::Polarity::kBright;
    }
  }
  return candidates;
}

[[noreturn]] void refuseAll(const std::vector<Candidate>& candidates) {
  const auto most = std::max_element(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.lattice.nodes.size() < b.lattice.nodes.size();
  });
  if (most == candidates.end() || most->lattice.nodes.size() < kFewestMarks) {
    refuse("no regular grid: at most ", most == candidates.end() ? 0 : most->lattice.nodes.size(),
           " marks follow each other regularly, ", kFewestMarks, " are needed");
  }
  refuse("no regular grid: the best guess has ", most->lattice.nodes.size(), " marks, covers ",
         std::lround(100.0 * most->covered_share), " % of the picture (at least ", std::lround(100.0 * kLeastCovered),
         " % are needed), fills ", std::lround(100.0 * most->filled_share), " % of what it covers (at least ",
         std::lround(100.0 * kLeastFilled), " %), and its marks lie ", most->lattice.roughness_px,
         " px beside the middle between their neighbours");
}

/// The one of the strongest contrast of those that cover about as much as any. Marks stand out most at their own size;
/// what lies between them, and the rings of a smaller scale, are regular too.
Candidate bestOf(const std::vector<Candidate>& candidates) {
  double most = 0.0;
  for (const Candidate& one : candidates) {
    if (isGrid(one)) most = std::max(most, one.covered_share);
  }
  if (most == 0.0) refuseAll(candidates);
  const Candidate* best = nullptr;
  for (const Candidate& one : candidates) {
    if (!isGrid(one) || one.covered_share < kSameArea * most) continue;
    if (best == nullptr || one.lattice.contrast > best->lattice.contrast) best = &one;
  }
  return *best;
}

double angleBetween(const Eigen::Matrix2d& steps) {
  return std::acos(steps.col(0).dot(steps.col(1)) / (steps.col(0).norm() * steps.col(1).norm())) * 180.0 / kPi;
}

/// New axes: the columns of `new_axes` in steps of the old ones.
void changeAxes(const Eigen::Matrix2i& new_axes, Lattice* lattice) {
  const Eigen::Matrix2d inverse = new_axes.cast<double>().inverse();
  for (Node& node : lattice->nodes) {
    const Eigen::Vector2d cell = inverse * node.cell.cast<double>();
    node.cell = Eigen::Vector2i(static_cast<int>(std::lround(cell.x())), static_cast<int>(std::lround(cell.y())));
  }
  lattice->steps = lattice->steps * new_axes.cast<double>();
}

/// Turns the axes so that the second lies 60° or 90° from the first, towards increasing rows.
GridKind arrangeAxes(Lattice* lattice) {
  if (lattice->steps.determinant() < 0.0) changeAxes((Eigen::Matrix2i() << 0, 1, 1, 0).finished(), lattice);
  if (angleBetween(lattice->steps) > 105.0) changeAxes((Eigen::Matrix2i() << 1, 1, 0, 1).finished(), lattice);
  const double a = lattice->steps.col(0).norm();
  const double b = lattice->steps.col(1).norm();
  const double angle = angleBetween(lattice->steps);
  if (std::max(a, b) <= kLargestSideRatio * std::min(a, b)) {
    if (std::abs(angle - 90.0) <= kAngleTolerance_deg) return GridKind::kSquare;
    if (std::abs(angle - 60.0) <= kAngleTolerance_deg) return GridKind::kHexagonal;
  }
  refuse("the cells in the middle of the picture have sides of ", a, " and ", b, " px at ", angle,
         "°: the grid is neither square nor hexagonal, so what is regular and what distortion cannot be told");
}

/// Lattice coordinates in steps of length 1 along x.
Eigen::Vector2d regular(GridKind kind, const Eigen::Vector2i& cell) {
  const double angle = kind == GridKind::kSquare ? 0.5 * kPi : kPi / 3.0;
  return {cell.x() + std::cos(angle) * cell.y(), std::sin(angle) * cell.y()};
}

/// Where the regular lattice lies at a pixel.
Eigen::Vector2d latticeAt(const PolynomialSurface& pixel_of, const Eigen::Vector2d& pixel, Eigen::Vector2d start) {
  for (int i = 0; i < 20; ++i) {
    start -= pixel_of.jacobianAt(start).inverse() * (pixel_of.at(start) - pixel);
  }
  return start;
}

/// Scale and rotation nearest to a 2 × 2 matrix.
Eigen::Matrix2d similarityOf(const Eigen::Matrix2d& m) {
  const double a = 0.5 * (m(0, 0) + m(1, 1));
  const double b = 0.5 * (m(1, 0) - m(0, 1));
  return (Eigen::Matrix2d() << a, -b, b, a).finished();
}

/// Lays the regular grid over the middle of the picture.
void straighten(const Lattice& lattice, const Eigen::Vector2d& middle, CalibrationGrid* grid) {
  std::vector<PlaneSample> samples;
  for (const Node& node : lattice.nodes) samples.push_back({regular(grid->kind, node.cell), node.pixel});
  const PolynomialSurface pixel_of = fitSurface(samples).surface;
  const auto nearest = std::min_element(samples.begin(), samples.end(), [&](const auto& a, const auto& b) {
    return (a.to - middle).norm() < (b.to - middle).norm();
  });
  const Eigen::Vector2d lattice_middle = latticeAt(pixel_of, middle, nearest->from);
  if (!((lattice_middle - nearest->from).norm() < 2.0)) {
    refuse("the grid does not cover the middle of the picture, where its scale and orientation are taken from");
  }
  const Eigen::Matrix2d similarity = similarityOf(pixel_of.jacobianAt(lattice_middle));
  grid->pitch_px = similarity.col(0).norm();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    grid->marks.push_back(
        {lattice.nodes[i].cell, samples[i].to, middle + similarity * (samples[i].from - lattice_middle)});
  }
}

}  // namespace

CalibrationGrid findCalibrationGrid(const FloatImage& picture) {
  const cv::Mat pixels = mask_detail::view(picture);
  double darkest = 0.0;
  double brightest = 0.0;
  cv::minMaxLoc(pixels, &darkest, &brightest);
  if (!cv::checkRange(pixels) || darkest < 0.0) refuse("the picture holds intensities that are negative or no numbers");
  if (darkest == brightest) refuse("the picture is constant: every pixel is ", darkest);
  Candidate best = bestOf(candidatesIn(pixels));
  CalibrationGrid grid;
  grid.bright_marks = best.bright;
  grid.filled_share = best.filled_share;
  grid.kind = arrangeAxes(&best.lattice);
  straighten(best.lattice, Eigen::Vector2d(0.5 * (picture.width - 1), 0.5 * (picture.height - 1)), &grid);
  return grid;
}

}  // namespace xray_registration

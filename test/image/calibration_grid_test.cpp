#include "xray_registration/image/calibration_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <set>
#include <string>

#include "test/image/distorted_grids.h"
#include "xray_registration/image/xray_image_file.h"

namespace xray_registration {
namespace {

using distorted::Detector;
using distorted::Grid;

std::string reasonOf(const FloatImage& picture) {
  try {
    const CalibrationGrid grid = findCalibrationGrid(picture);
    return "found " + std::to_string(grid.marks.size()) + " marks";
  } catch (const GridError& error) {
    return error.what();
  }
}

void expectRefusal(const std::string& expected, const FloatImage& picture) {
  const std::string reason = reasonOf(picture);
  EXPECT_NE(reason.find(expected), std::string::npos) << "said: " << reason;
}

/// Lengths of what marks are off by, pixels.
struct Deviation {
  double rms = 0.0;
  double largest = 0.0;
};

Deviation deviationOf(const CalibrationGrid& grid, const std::function<Eigen::Vector2d(const GridMark&)>& difference) {
  Deviation deviation;
  for (const GridMark& mark : grid.marks) {
    const double length = difference(mark).norm();
    deviation.rms += length * length / static_cast<double>(grid.marks.size());
    deviation.largest = std::max(deviation.largest, length);
  }
  deviation.rms = std::sqrt(deviation.rms);
  return deviation;
}

/// From the mark found to the place where the nearest one is; a mesh's bright cells lie between its marks.
Eigen::Vector2d offPlace(const GridMark& mark, const Grid& grid, const Detector& detector, bool between) {
  const Eigen::Vector2d shift = between ? Eigen::Vector2d(0.5, 0.5) : Eigen::Vector2d(0.0, 0.0);
  const Eigen::Vector2d origin = detector.middle() + grid.offset_px + grid.steps() * shift;
  const Eigen::Vector2d cell = grid.steps().inverse() * (detector.straightOf(mark.raw) - origin);
  return mark.raw - detector.rawOf(origin + grid.steps() * distorted::roundedCell(cell).cast<double>());
}

/// The marks that an undistortion map is made of: not those that the edge of the beam has cut.
CalibrationGrid withoutOutliers(const CalibrationGrid& grid, const Detector& detector) {
  std::vector<PixelPair> pairs;
  for (const GridMark& mark : grid.marks) pairs.push_back({mark.raw, mark.straight});
  UndistortionFit fit;
  UndistortionMap::fitted(detector.width, detector.height, pairs, &fit);
  CalibrationGrid kept = grid;
  kept.marks.clear();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (fit.used[i]) kept.marks.push_back(grid.marks[i]);
  }
  return kept;
}

struct Case {
  const char* name;
  Grid grid;
  Detector detector;
  bool bright;
};

std::vector<Case> cases() {
  std::vector<Case> list;
  Grid beads;
  beads.noise = 15.0;
  list.push_back({"beads", beads, {}, false});
  Grid worn = beads;
  worn.missing_share = 0.12;
  worn.angle_rad = 0.4;
  worn.field_radius_px = 190.0;
  worn.shading = 0.6;
  list.push_back(
      {"turned, missing beads, round field, shading, both distortions", worn, {400, 400, 10.0, 12.0}, false});
  Grid holes;
  holes.shape = Grid::Shape::kHoles;
  holes.hexagonal = true;
  holes.angle_rad = 0.1;
  holes.field_radius_px = 195.0;
  holes.noise = 15.0;
  list.push_back({"hexagonal holes, S-shape", holes, {400, 400, 14.0, 0.0}, true});
  Grid mesh;
  mesh.shape = Grid::Shape::kMesh;
  mesh.pitch_px = 22.0;
  mesh.angle_rad = -0.2;
  mesh.noise = 10.0;
  list.push_back({"wire mesh, S-shape and pincushion", mesh, {440, 400, -12.0, 8.0}, true});
  Grid large = beads;
  large.pitch_px = 40.0;
  list.push_back({"few large beads", large, {400, 440, 8.0, 8.0}, false});
  return list;
}

TEST(CalibrationGrid, IsFoundAndStraightened) {
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.name);
    const CalibrationGrid grid = findCalibrationGrid(distorted::pictureOf(one.grid, one.detector));
    EXPECT_EQ(grid.kind, one.grid.hexagonal ? GridKind::kHexagonal : GridKind::kSquare);
    const bool is_mesh = one.grid.shape == Grid::Shape::kMesh;
    if (!is_mesh) {
      EXPECT_EQ(grid.bright_marks, one.bright);
    }
    // Marks at the rim may be hidden in part.
    const std::size_t there = distorted::marksOf(one.grid, one.detector).size();
    EXPECT_GE(grid.marks.size(), there * 95 / 100);
    // And one ring around them; what lies between the marks would double their number.
    EXPECT_LE(grid.marks.size(), there + 5 * static_cast<std::size_t>(std::sqrt(static_cast<double>(there))));
    const bool between = is_mesh && grid.bright_marks;
    const CalibrationGrid regular = withoutOutliers(grid, one.detector);
    EXPECT_GE(regular.marks.size(), there * 95 / 100);
    const Deviation found =
        deviationOf(regular, [&](const GridMark& mark) { return offPlace(mark, one.grid, one.detector, between); });
    // Noise of 1.5 % of the beam on contrasts of a half: some hundredths of a pixel. Where a
    // neighbour is missing or the beam's edge is near, a mark's middle is off by more.
    EXPECT_LT(found.rms, 0.12);
    EXPECT_LT(found.largest, 0.6);
    // The middle fixes the straight grid: what scale and orientation are off by grows outwards. 0.15 px at 200 are 0.08
    // %.
    const Deviation straight = deviationOf(regular, [&](const GridMark& mark) {
      const Eigen::Vector2d raw = mark.raw - offPlace(mark, one.grid, one.detector, between);
      return Eigen::Vector2d(mark.straight - one.detector.straightOf(raw));
    });
    EXPECT_LT(straight.rms, 0.15);
    EXPECT_NEAR(grid.pitch_px, one.grid.pitch_px, 1e-3 * one.grid.pitch_px);
  }
}

TEST(CalibrationGrid, CellsCountNeighbours) {
  Grid beads;
  const CalibrationGrid grid = findCalibrationGrid(distorted::pictureOf(beads, {}));
  std::set<std::pair<int, int>> cells;
  for (const GridMark& mark : grid.marks) cells.insert({mark.cell.x(), mark.cell.y()});
  EXPECT_EQ(cells.size(), grid.marks.size()) << "a cell has one mark";
  const GridMark& first = grid.marks.front();
  for (const GridMark& mark : grid.marks) {
    const Eigen::Vector2d steps = (mark.cell - first.cell).cast<double>();
    EXPECT_NEAR((mark.straight - first.straight).norm(), grid.pitch_px * steps.norm(), 1e-6);
  }
}

TEST(CalibrationGrid, WhatIsNoGridIsRefusedInWords) {
  expectRefusal("constant", FloatImage(200, 200, 7.0F));
  FloatImage negative(200, 200, 7.0F);
  negative.at(3, 3) = -1.0F;
  expectRefusal("negative", negative);

  for (unsigned seed = 1; seed <= 5; ++seed) {
    Grid nothing;
    nothing.missing_share = 1.0;
    nothing.noise = 30.0;
    expectRefusal("no regular grid", distorted::pictureOf(nothing, {}, seed));
  }

  Grid few;
  few.pitch_px = 110.0;
  expectRefusal("are needed", distorted::pictureOf(few, {}));

  Grid mostly_missing;
  mostly_missing.missing_share = 0.7;
  expectRefusal("no regular grid", distorted::pictureOf(mostly_missing, {}));

  Grid oblong;
  oblong.stretch = 1.3;
  expectRefusal("neither square nor hexagonal", distorted::pictureOf(oblong, {}));
}

TEST(CalibrationGrid, AGridBesideTheMiddleIsRefused) {
  Grid beads;
  FloatImage picture = distorted::pictureOf(beads, {});
  for (int v = 0; v < picture.height; ++v) {
    for (int u = 0; u < 260; ++u) picture.at(u, v) = 1000.0F;
  }
  expectRefusal("middle of the picture", picture);
}

/// Recordings that are no part of the project; the folder is named by XRAY_REGISTRATION_DATA.
class RealGrid : public testing::Test {
 protected:
  void SetUp() override {
    if (const char* folder = std::getenv("XRAY_REGISTRATION_DATA")) data_ = folder;
    if (data_.empty()) GTEST_SKIP() << "XRAY_REGISTRATION_DATA does not name the recorded X-rays";
  }

  FloatImage picture(const std::string& name) const {
    return floatsOf(readXrayImage(data_ + "/xray_dicom/" + name + ".dcm").pixels);
  }

  std::string data_;
};

TEST_F(RealGrid, PlateWithHolesInFrontOfAnImageIntensifier) {
  for (const char* name : {"siemens_arcadis_grid_centred", "siemens_arcadis_grid_orbit30"}) {
    SCOPED_TRACE(name);
    const CalibrationGrid grid = findCalibrationGrid(picture(name));
    EXPECT_EQ(grid.kind, GridKind::kHexagonal);
    EXPECT_TRUE(grid.bright_marks);
    // A hole takes 209 px², and the field, without the rim that the collimator shades, two thirds of 1024² px.
    EXPECT_GT(grid.marks.size(), 3200U);
    EXPECT_NEAR(grid.pitch_px, 15.5, 0.1);
    std::vector<PixelPair> pairs;
    for (const GridMark& mark : grid.marks) pairs.push_back({mark.raw, mark.straight});
    UndistortionFit fit;
    UndistortionMap::fitted(1024, 1024, pairs, &fit);
    EXPECT_GT(fit.before.max_px, 10.0);
    // 0.2 px are 0.04 mm on the plate: rows of holes are off together, as they were drilled.
    EXPECT_LT(fit.after.rms_px, 0.25);
    EXPECT_GE(fit.points_used, static_cast<int>(grid.marks.size() * 98 / 100));
  }
}

/// What a map leaves of a grid's distortion, rms of what no similarity explains.
double leftOver(const CalibrationGrid& grid, const UndistortionMap& map) {
  std::vector<std::complex<double>> regular;
  std::vector<std::complex<double>> straightened;
  for (const GridMark& mark : grid.marks) {
    Eigen::Vector2d straight = mark.raw;
    for (int i = 0; i < 50; ++i) straight += mark.raw - map.rawPixel(straight);
    if (!map.covers(straight)) continue;
    regular.emplace_back(mark.straight.x(), mark.straight.y());
    straightened.emplace_back(straight.x(), straight.y());
  }
  const auto centred = [](std::vector<std::complex<double>>* values) {
    const auto mean =
        std::accumulate(values->begin(), values->end(), std::complex<double>()) / static_cast<double>(values->size());
    for (std::complex<double>& value : *values) value -= mean;
  };
  centred(&regular);
  centred(&straightened);
  std::complex<double> product;
  double squares = 0.0;
  for (std::size_t i = 0; i < regular.size(); ++i) {
    product += std::conj(regular[i]) * straightened[i];
    squares += std::norm(regular[i]);
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < regular.size(); ++i) sum += std::norm(straightened[i] - product / squares * regular[i]);
  return std::sqrt(sum / static_cast<double>(regular.size()));
}

TEST_F(RealGrid, ADeviceThatIsTurnedIsDistortedOtherwise) {
  std::vector<CalibrationGrid> grids;
  std::vector<UndistortionMap> maps;
  for (const char* name : {"siemens_arcadis_grid_centred", "siemens_arcadis_grid_orbit30"}) {
    grids.push_back(findCalibrationGrid(picture(name)));
    std::vector<PixelPair> pairs;
    for (const GridMark& mark : grids.back().marks) pairs.push_back({mark.raw, mark.straight});
    maps.push_back(UndistortionMap::fitted(1024, 1024, pairs));
  }
  for (const std::size_t own : {0, 1}) {
    const double with_own = leftOver(grids[own], maps[own]);
    const double with_other = leftOver(grids[own], maps[1 - own]);
    // For docs/accuracy.md.
    std::printf("grid %zu: rms %.3f px with its own map, %.3f px with that of the other orientation\n", own, with_own,
                with_other);
    EXPECT_LT(with_own, 0.25);
    // 30° along the orbit are some tenths of a pixel; the earth's field turns against the intensifier.
    EXPECT_LT(with_other, 0.6);
    EXPECT_GT(with_other, 1.3 * with_own);
  }
}

TEST_F(RealGrid, OtherPicturesOfTheSameDeviceAreNone) {
  for (const char* name : {"siemens_arcadis_beads_centred", "siemens_arcadis_spine_centred", "loopx_pelvis_dx"}) {
    SCOPED_TRACE(name);
    expectRefusal("no regular grid", picture(name));
  }
}

}  // namespace
}  // namespace xray_registration

#include "xray_registration/volume/phantom.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "xray_registration/common/parallel.h"

namespace xray_registration {
namespace {

constexpr double kAirHu = -1000.0;
// Denser than this is bone; marrow and cavities are not.
constexpr int kBoneHu = 100;

// An ellipsoid as the unit ball of x -> shape (x - centre).
struct Ball {
  Eigen::Matrix3d shape;
  Eigen::Vector3d centre;
  std::int16_t hu = 0;
};

std::vector<Ball> ballsOf(const std::vector<PhantomEllipsoid>& shapes) {
  std::vector<Ball> balls;
  balls.reserve(shapes.size());
  for (const PhantomEllipsoid& shape : shapes) {
    if (!(shape.semi_axes_mm.array() > 0.0).all())
      throw std::invalid_argument("an ellipsoid's semi-axes must be positive");
    Ball ball;
    ball.shape = shape.semi_axes_mm.cwiseInverse().asDiagonal() * shape.rotation.transpose();
    ball.centre = shape.centre_ct_mm;
    ball.hu = static_cast<std::int16_t>(std::clamp(std::round(shape.hu), -32768.0, 32767.0));
    balls.push_back(ball);
  }
  return balls;
}

// Fills the samples start + i step, i = 0 … row.size() - 1, that lie in the ball: the interval between the roots of
// |shape (start + i step - centre)|² = 1.
void paintRow(const Ball& ball, const Eigen::Vector3d& start, const Eigen::Vector3d& step,
              std::vector<std::int16_t>* row) {
  const Eigen::Vector3d p = ball.shape * (start - ball.centre);
  const Eigen::Vector3d d = ball.shape * step;
  const double a = d.squaredNorm();
  const double b = p.dot(d);
  const double discriminant = b * b - a * (p.squaredNorm() - 1.0);
  if (!(discriminant > 0.0)) return;
  const double root = std::sqrt(discriminant);
  const double last = static_cast<double>(row->size()) - 1.0;
  const double begin = std::max(0.0, std::ceil((-b - root) / a));
  const double end = std::min(last, std::floor((-b + root) / a));
  if (begin > end) return;
  std::fill(row->begin() + static_cast<std::ptrdiff_t>(begin), row->begin() + static_cast<std::ptrdiff_t>(end) + 1,
            ball.hu);
}

// Share of the interval [i, i + 1) voxels that lies inside [begin, end), all in voxels.
double coverage(int i, double begin, double end) {
  return std::max(0.0, std::min<double>(i + 1, end) - std::max<double>(i, begin));
}

}  // namespace

Volume paintPhantom(const VolumeGrid& grid, const std::vector<PhantomEllipsoid>& shapes, int supersampling) {
  if ((grid.size.array() < 1).any() || supersampling < 1) {
    throw std::invalid_argument("a phantom needs at least one voxel and one sample per voxel");
  }
  const std::vector<Ball> balls = ballsOf(shapes);
  Volume volume;
  volume.grid = grid;
  volume.name = "phantom";
  volume.hu.resize(grid.voxelCount());
  const Eigen::Affine3d ct_from_index = grid.ctFromIndex();
  const int samples = supersampling;
  const double first_sample = 0.5 / samples - 0.5;
  const Eigen::Vector3d step = ct_from_index.linear().col(0) / samples;
  parallelFor(grid.size.z(), [&](int begin, int end) {
    const auto width = static_cast<std::size_t>(grid.size.x());
    std::vector<std::int16_t> row(width * static_cast<std::size_t>(samples));
    std::vector<int> sum(width);
    for (int z = begin; z < end; ++z) {
      for (int y = 0; y < grid.size.y(); ++y) {
        std::fill(sum.begin(), sum.end(), 0);
        for (int s = 0; s < samples * samples; ++s) {
          const int sample_y = s % samples;
          const int sample_z = s / samples;
          const Eigen::Vector3d index(first_sample, y + first_sample + static_cast<double>(sample_y) / samples,
                                      z + first_sample + static_cast<double>(sample_z) / samples);
          std::fill(row.begin(), row.end(), static_cast<std::int16_t>(kAirHu));
          for (const Ball& ball : balls) paintRow(ball, ct_from_index * index, step, &row);
          for (std::size_t i = 0; i < row.size(); ++i) sum[i / static_cast<std::size_t>(samples)] += row[i];
        }
        std::int16_t* out = volume.hu.data() + (static_cast<std::size_t>(z) * grid.size.y() + y) * width;
        const double per_voxel = static_cast<double>(samples) * samples * samples;
        for (std::size_t x = 0; x < width; ++x) out[x] = static_cast<std::int16_t>(std::lround(sum[x] / per_voxel));
      }
    }
  });
  return volume;
}

LabelVolume paintLabels(const Volume& painted, const std::vector<PhantomEllipsoid>& shapes) {
  std::vector<PhantomEllipsoid> marked = shapes;
  for (PhantomEllipsoid& shape : marked) shape.hu = shape.label;
  const Volume values = paintPhantom(painted.grid, marked, 1);
  LabelVolume labels;
  labels.grid = painted.grid;
  labels.labels.resize(painted.hu.size());
  for (std::size_t i = 0; i < painted.hu.size(); ++i) {
    labels.labels[i] = painted.hu[i] > kBoneHu ? static_cast<std::uint16_t>(std::max<int>(0, values.hu[i])) : 0;
  }
  return labels;
}

Volume whiteCube(int n, double side_mm) {
  if (n < 4 || n > 1024 || !(side_mm > 0.0)) throw std::invalid_argument("the cube needs 4 to 1024 voxels a side");
  Volume volume;
  volume.name = "white cube " + std::to_string(n);
  volume.grid.size.setConstant(n);
  volume.grid.spacing_mm.setConstant(side_mm / n);
  volume.grid.origin_ct_mm.setConstant(-0.5 * side_mm * (n - 1) / n);
  volume.hu.resize(volume.grid.voxelCount());
  std::vector<double> share(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) share[static_cast<std::size_t>(i)] = coverage(i, 0.25 * n, 0.75 * n);
  std::size_t index = 0;
  for (const double z : share) {
    for (const double y : share) {
      for (const double x : share)
        volume.hu[index++] = static_cast<std::int16_t>(std::lround(kAirHu * (1.0 - x * y * z)));
    }
  }
  return volume;
}

}  // namespace xray_registration

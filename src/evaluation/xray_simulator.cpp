#include "xray_registration/evaluation/xray_simulator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "xray_registration/drr/reference_projector.h"

namespace xray_registration {
namespace {

constexpr double kPhotonsWithoutNoise = 20000.0;
constexpr double kLargestCount = 65535.0;

/// Stretch of a ray, as distances from the source; empty when enter ≥ leave.
struct Stretch {
  double enter = std::numeric_limits<double>::infinity();
  double leave = -std::numeric_limits<double>::infinity();
  bool empty() const { return !(enter < leave); }
};

Stretch throughBall(const Eigen::Vector3d& centre, double radius, const Eigen::Vector3d& direction) {
  const double along = centre.dot(direction);
  const double half_squared = radius * radius - (centre - along * direction).squaredNorm();
  if (half_squared <= 0.0) return {};
  return {along - std::sqrt(half_squared), along + std::sqrt(half_squared)};
}

/// The cylinder between both ends, without the balls.
Stretch throughCylinder(const Instrument& instrument, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d span = instrument.b_camera_mm - instrument.a_camera_mm;
  const double length = span.norm();
  if (length == 0.0) return {};
  const Eigen::Vector3d axis = span / length;
  const double direction_along = direction.dot(axis);
  const double start_along = -instrument.a_camera_mm.dot(axis);
  const Eigen::Vector3d direction_across = direction - direction_along * axis;
  const Eigen::Vector3d start_across = -instrument.a_camera_mm - start_along * axis;

  Stretch stretch{0.0, std::numeric_limits<double>::infinity()};
  const double a = direction_across.squaredNorm();
  const double c = start_across.squaredNorm() - instrument.radius_mm * instrument.radius_mm;
  if (a > 1e-18) {
    const double half_b = start_across.dot(direction_across);
    const double root = half_b * half_b - a * c;
    if (root <= 0.0) return {};
    stretch = {(-half_b - std::sqrt(root)) / a, (-half_b + std::sqrt(root)) / a};
  } else if (c >= 0.0) {
    return {};
  }
  if (std::abs(direction_along) > 1e-12) {
    const double at_a = -start_along / direction_along;
    const double at_b = (length - start_along) / direction_along;
    stretch.enter = std::max(stretch.enter, std::min(at_a, at_b));
    stretch.leave = std::min(stretch.leave, std::max(at_a, at_b));
  } else if (start_along <= 0.0 || start_along >= length) {
    return {};
  }
  return stretch;
}

void requireRange(const char* name, double value, double lowest, double highest) {
  if (value >= lowest && value <= highest) return;
  throw std::invalid_argument(std::string("simulated X-ray: ") + name + " is " + std::to_string(value) +
                              ", it must be between " + std::to_string(lowest) + " and " + std::to_string(highest));
}

void check(const XrayCamera& camera, const XrayPhysics& physics) {
  const std::string problem = camera.problem();
  if (!problem.empty()) throw std::invalid_argument("simulated X-ray: " + problem);
  requireRange("photons_per_pixel", physics.photons_per_pixel, 0.0, 1e9);
  requireRange("readout_noise", physics.readout_noise, 0.0, 1e6);
  requireRange("scatter_fraction", physics.scatter_fraction, 0.0, 100.0);
  requireRange("scatter_sigma_px", physics.scatter_sigma_px, 0.0, 1e4);
  requireRange("gain", physics.gain, 1e-9, 1e9);
  requireRange("saturation", physics.saturation, 1.0, 1e9);
  requireRange("collimator_radius_px", physics.collimator_radius_px, 0.0, 1e9);
  requireRange("samples_per_pixel_axis", physics.samples_per_pixel_axis, 1, 16);
}

/// `camera` with every pixel split into n × n.
XrayCamera split(const XrayCamera& camera, int n) {
  XrayCamera fine = camera;
  fine.width *= n;
  fine.height *= n;
  fine.fx *= n;
  fine.fy *= n;
  fine.cx = (camera.cx + 0.5) * n - 0.5;
  fine.cy = (camera.cy + 0.5) * n - 0.5;
  return fine;
}

/// Share of the beam that reaches each pixel. Intensities are averaged over a pixel, not their logarithms.
FloatImage transmission(const std::vector<PosedVolume>& parts, const XrayCamera& camera, const XrayPhysics& physics) {
  const int n = physics.samples_per_pixel_axis;
  const XrayCamera fine = split(camera, n);
  FloatImage integrals(fine.width, fine.height, 0.0F);
  for (const PosedVolume& part : parts) {
    const FloatImage of_part = referenceProjection(*part.volume, part.T_camera_volume, fine);
    for (std::size_t i = 0; i < of_part.pixels.size(); ++i) integrals.pixels[i] += of_part.pixels[i];
  }
  FloatImage mean(camera.width, camera.height, 0.0F);
  for (int v = 0; v < fine.height; ++v) {
    for (int u = 0; u < fine.width; ++u) {
      double integral = integrals.at(u, v);
      for (const Instrument& instrument : physics.instruments) {
        integral += instrument.attenuation_per_mm * instrumentChordMm(instrument, fine.rayDirection(u, v));
      }
      mean.at(u / n, v / n) += static_cast<float>(std::exp(-integral) / (n * n));
    }
  }
  return mean;
}

void collimate(double radius_px, FloatImage* image) {
  if (radius_px <= 0.0) return;
  const double centre_u = 0.5 * (image->width - 1);
  const double centre_v = 0.5 * (image->height - 1);
  for (int v = 0; v < image->height; ++v) {
    for (int u = 0; u < image->width; ++u) {
      const double inside = radius_px - std::hypot(u - centre_u, v - centre_v) + 0.5;
      image->at(u, v) *= static_cast<float>(std::clamp(inside, 0.0, 1.0));
    }
  }
}

std::vector<double> gaussian(double sigma) {
  const int reach = static_cast<int>(std::ceil(3.0 * sigma));
  std::vector<double> kernel;
  double sum = 0.0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(sigma > 0.0 ? std::exp(-0.5 * i * i / (sigma * sigma)) : 1.0);
    sum += kernel.back();
  }
  for (double& weight : kernel) weight /= sum;
  return kernel;
}

/// Index of a pixel beyond the border, mirrored about the border's edge as often as it takes: keeps the sum.
int mirrored(int i, int size) {
  const int period = 2 * size;
  i = ((i % period) + period) % period;
  return i < size ? i : period - 1 - i;
}

/// Each line of the image filtered and written transposed: twice gives a separable filter.
FloatImage filteredTransposed(const FloatImage& image, const std::vector<double>& kernel) {
  const int reach = static_cast<int>(kernel.size() / 2);
  FloatImage result(image.height, image.width);
  std::vector<double> line(static_cast<std::size_t>(image.width + 2 * reach));
  for (int v = 0; v < image.height; ++v) {
    for (int i = 0; i < static_cast<int>(line.size()); ++i) {
      line[static_cast<std::size_t>(i)] = image.at(mirrored(i - reach, image.width), v);
    }
    for (int u = 0; u < image.width; ++u) {
      double sum = 0.0;
      for (std::size_t i = 0; i < kernel.size(); ++i) sum += kernel[i] * line[static_cast<std::size_t>(u) + i];
      result.at(v, u) = static_cast<float>(sum);
    }
  }
  return result;
}

void addScatter(const XrayPhysics& physics, FloatImage* image) {
  if (physics.scatter_fraction <= 0.0) return;
  const std::vector<double> kernel = gaussian(physics.scatter_sigma_px);
  const FloatImage veil = filteredTransposed(filteredTransposed(*image, kernel), kernel);
  for (std::size_t i = 0; i < veil.pixels.size(); ++i) {
    image->pixels[i] += static_cast<float>(physics.scatter_fraction) * veil.pixels[i];
  }
}

double detectedPhotons(double expected, bool noisy, std::mt19937_64* random) {
  if (!noisy || expected <= 0.0) return expected;
  return static_cast<double>(std::poisson_distribution<std::int64_t>(expected)(*random));
}

}  // namespace

double instrumentChordMm(const Instrument& instrument, const Eigen::Vector3d& direction_camera) {
  const Eigen::Vector3d direction = direction_camera.normalized();
  // A capsule is convex: its stretch reaches from the first entry to the last exit of its three parts.
  Stretch whole;
  for (const Stretch& part :
       {throughBall(instrument.a_camera_mm, instrument.radius_mm, direction),
        throughBall(instrument.b_camera_mm, instrument.radius_mm, direction), throughCylinder(instrument, direction)}) {
    if (part.empty()) continue;
    whole.enter = std::min(whole.enter, part.enter);
    whole.leave = std::max(whole.leave, part.leave);
  }
  if (whole.empty()) return 0.0;
  return std::max(0.0, whole.leave - std::max(0.0, whole.enter));
}

Image<std::uint16_t> simulateXray(const AttenuationVolume& volume, const RigidTransform& T_camera_ct,
                                  const XrayCamera& camera, const XrayPhysics& physics, std::mt19937_64* random) {
  return simulateXray({{&volume, T_camera_ct}}, camera, physics, random);
}

Image<std::uint16_t> simulateXray(const std::vector<PosedVolume>& parts, const XrayCamera& camera,
                                  const XrayPhysics& physics, std::mt19937_64* random) {
  check(camera, physics);
  FloatImage beam = transmission(parts, camera, physics);
  collimate(physics.collimator_radius_px, &beam);
  addScatter(physics, &beam);

  const bool noisy = physics.photons_per_pixel > 0.0;
  const double photons = noisy ? physics.photons_per_pixel : kPhotonsWithoutNoise;
  const double largest = std::min(physics.saturation, kLargestCount);
  std::normal_distribution<double> readout(0.0, 1.0);
  Image<std::uint16_t> image(camera.width, camera.height);
  // One thread, in the order of the pixels: the same generator state gives the same image.
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    double counts = physics.gain * detectedPhotons(photons * beam.pixels[i], noisy, random);
    if (physics.readout_noise > 0.0) counts += physics.readout_noise * readout(*random);
    image.pixels[i] = static_cast<std::uint16_t>(std::lround(std::clamp(counts, 0.0, largest)));
  }
  return image;
}

}  // namespace xray_registration

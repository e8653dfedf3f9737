#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "xray_registration/volume/phantom.h"

namespace xray_registration {

/// Collects a phantom's ellipsoids. Coordinates in mm about the phantom's own centre, patient axes (x left, y towards
/// the back, z up); `shift_mm` moves all of them into the CT frame.
class ShapeList {
 public:
  explicit ShapeList(const Eigen::Vector3d& shift_mm) : shift_mm_(shift_mm) {}

  /// What is added from here on belongs to the bone with this label; 0 to none.
  void setLabel(int label) { label_ = label; }

  /// `turn_deg`: rotations about x, y and z, applied in this order.
  void add(const Eigen::Vector3d& centre, const Eigen::Vector3d& semi_axes, double hu,
           const Eigen::Vector3d& turn_deg = Eigen::Vector3d::Zero());

  /// A bone: compact shell of `shell_mm` around a core of spongy bone.
  void addBone(const Eigen::Vector3d& centre, const Eigen::Vector3d& semi_axes, double shell_mm,
               const Eigen::Vector3d& turn_deg = Eigen::Vector3d::Zero(), double shell_hu = 900.0,
               double core_hu = 250.0);

  /// A rod between two points.
  void addRod(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_mm, double hu);

  /// `count` small pieces inside an ellipsoid's shell between `inner` and 1 (shares of its semi-axes), HU and radii
  /// drawn from the ranges: the uneven inside of bone. The same at every call.
  void addPieces(int count, const Eigen::Vector3d& centre, const Eigen::Vector3d& semi_axes, double inner,
                 const Eigen::Vector2d& radius_mm, const Eigen::Vector2d& hu);

  const std::vector<PhantomEllipsoid>& shapes() const { return shapes_; }

 private:
  double uniform(double low, double high);

  Eigen::Vector3d shift_mm_;
  std::vector<PhantomEllipsoid> shapes_;
  int label_ = 0;
  std::mt19937 random_{20080101U};
};

/// Grid of isotropic voxels whose box is centred in `centre_ct_mm`.
/// @throws std::invalid_argument for a spacing below 0.2 mm or above 20 mm.
VolumeGrid phantomGrid(const Eigen::Vector3d& extent_mm, double spacing_mm, const Eigen::Vector3d& centre_ct_mm);

}  // namespace xray_registration

#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "xray_registration/common/escaped.h"

namespace xray_registration {

struct PolynomialSurface;

/// A file that holds no undistortion map, or points that none can be made of; the message names the file.
class UndistortionMapError : public EscapedError {
 public:
  using EscapedError::EscapedError;
};

/// A point of a picture as the detector shows it, and where it would lie without distortion. Pixels.
struct PixelPair {
  Eigen::Vector2d raw;
  Eigen::Vector2d straight;
};

/// Lengths of differences in pixels.
struct PixelResidual {
  double rms_px = 0.0;
  double max_px = 0.0;
};

/// What a map was made of and how well it fits.
struct UndistortionFit {
  std::vector<bool> used;  ///< Per point; false for those that contradict the others.
  int points_used = 0;
  PixelResidual before;                 ///< Raw against straight points, of those used.
  PixelResidual after;                  ///< Raw points against where the map has them, of those used.
  double cross_validated_rms_px = 0.0;  ///< The same for points that the map was not fitted to.
};

/// Undoes a detector's own distortion, that of an image intensifier above all: pincushion, S-shape and what is local.
/// For each pixel of the straight picture it says where the raw picture shows it: a polynomial displacement whose
/// degree cross-validation has chosen. Coordinates are pixels of the whole, unbinned sensor; integers are pixel
/// centres.
///
/// A map is known inside the hull of the points it was made of. Outside it goes on with the displacement of the hull's
/// nearest place, so that pictures stay smooth, and `covers` says that nothing there is to be used.
/// Does not change; any thread.
class UndistortionMap {
 public:
  /// Fits a map for a sensor of width × height pixels.
  /// @param fit  Takes what it was made of when not null.
  /// @throws UndistortionMapError for fewer than 12 points, or points that lie on a line.
  static UndistortionMap fitted(int width, int height, const std::vector<PixelPair>& points,
                                UndistortionFit* fit = nullptr);

  /// docs/formats.md describes the file.
  /// @throws UndistortionMapError naming the file and what is wrong with it.
  static UndistortionMap read(const std::string& path);
  void write(const std::string& path) const;

  /// Size of the sensor.
  int width() const { return width_; }
  int height() const { return height_; }
  /// Of the polynomials.
  int degree() const;

  /// Where the raw picture shows what belongs at `straight`.
  Eigen::Vector2d rawPixel(const Eigen::Vector2d& straight) const;

  /// Whether `straight` lies in the hull of the points that the map was made of.
  bool covers(const Eigen::Vector2d& straight) const;

 private:
  UndistortionMap() = default;

  int width_ = 0;
  int height_ = 0;
  std::shared_ptr<const PolynomialSurface> displacement_;  ///< Raw minus straight.
  std::vector<Eigen::Vector2d> hull_;                      ///< Straight pixels, convex, in order.
};

}  // namespace xray_registration

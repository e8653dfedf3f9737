#pragma once

#include <optional>
#include <string>
#include <vector>

#include "landmark_solver.h"
#include "marker_shapes.h"

namespace xray_registration {

/// Landmarks as somebody clicks them: a point of the CT, then where each view shows it; or a pixel first and its point
/// after it. Knows no topics. Not thread-safe.
class ClickedPoints {
 public:
  /// Begins a new landmark; pixels that wait become its own. One that has no pixel yet is replaced.
  void addPoint(const Eigen::Vector3d& point_ct);

  /// Of the last landmark, when that has none in this view; otherwise it waits for its point.
  void addPixel(const std::string& view, const Eigen::Vector2d& pixel);

  /// The last click, whichever it was, with what belongs to it.
  void takeBack();
  void clear();

  /// Landmarks with their pixels, and how many there are.
  std::vector<SeenPoint> seen() const;
  std::size_t pairCount() const;

  /// Which of `seen` agree, in its order.
  void judge(const std::vector<bool>& agrees);
  std::vector<ShownLandmark> shown() const;

  /// For the log: "3 landmarks; the last one waits for its pixel".
  std::string inWords() const;

 private:
  struct Pixel {
    std::string view;
    Eigen::Vector2d at;
    std::optional<bool> agrees;
  };
  struct Clicked {
    Eigen::Vector3d point_ct;
    std::vector<Pixel> pixels;
  };
  std::vector<Clicked> landmarks_;
  std::vector<Pixel> waiting_;  ///< Pixels without a point, one for each view.
};

}  // namespace xray_registration

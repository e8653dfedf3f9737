#include "tools/inspect_ct/planes.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

namespace xray_registration::tools {
namespace {

constexpr int kLongestSide_px = 400;
constexpr int kMargin_px = 24;
constexpr double kBlackHu = -500.0;
constexpr double kWhiteHu = 1000.0;
const cv::Scalar kOutside(90, 50, 30);
const cv::Scalar kLetters(255, 255, 255);

// The CT's box in the patient's axes.
struct Box {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

Box boxOf(const VolumeGrid& grid) {
  const auto corners = grid.cornersCt();
  Box box{corners[0], corners[0]};
  for (const Eigen::Vector3d& corner : corners) {
    box.low = box.low.cwiseMin(corner);
    box.high = box.high.cwiseMax(corner);
  }
  return box;
}

// Which patient axes run to the right and down in a picture, and what is at its sides.
struct Plane {
  int across;
  int down;
  bool down_is_reversed;
  const char* left;
  const char* right;
  const char* top;
  const char* bottom;
  const char* name;
};

constexpr Plane kPlanes[] = {{0, 1, false, "R", "L", "A", "P", "axial"},
                             {0, 2, true, "R", "L", "S", "I", "coronal"},
                             {1, 2, true, "A", "P", "S", "I", "sagittal"}};

unsigned char greyOf(std::int16_t hu) {
  return static_cast<unsigned char>(std::clamp(255.0 * (hu - kBlackHu) / (kWhiteHu - kBlackHu), 0.0, 255.0));
}

// The voxel that holds a point, or none.
const std::int16_t* voxelAt(const Volume& ct, const Eigen::Vector3d& index) {
  const Eigen::Vector3i nearest = index.array().round().cast<int>();
  if ((nearest.array() < 0).any() || (nearest.array() >= ct.grid.size.array()).any()) return nullptr;
  const auto rows = static_cast<std::size_t>(nearest.z()) * ct.grid.size.y() + nearest.y();
  return &ct.hu[rows * ct.grid.size.x() + nearest.x()];
}

void write(const std::string& text, int x, int y, cv::Mat* picture) {
  cv::putText(*picture, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, 0.5, kLetters, 1, cv::LINE_AA);
}

cv::Mat drawn(const Volume& ct, const Box& box, const Plane& plane, double pixel_mm) {
  const int width = std::max(1, static_cast<int>((box.high - box.low)[plane.across] / pixel_mm));
  const int height = std::max(1, static_cast<int>((box.high - box.low)[plane.down] / pixel_mm));
  cv::Mat slice(height, width, CV_8UC3, kOutside);
  const Eigen::Affine3d index_from_ct = ct.grid.ctFromIndex().inverse();
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      Eigen::Vector3d point = ct.grid.centreCt();
      point[plane.across] = box.low[plane.across] + (u + 0.5) * pixel_mm;
      const double along = (v + 0.5) * pixel_mm;
      point[plane.down] = plane.down_is_reversed ? box.high[plane.down] - along : box.low[plane.down] + along;
      if (const std::int16_t* hu = voxelAt(ct, index_from_ct * point)) {
        slice.at<cv::Vec3b>(v, u) = cv::Vec3b::all(greyOf(*hu));
      }
    }
  }
  cv::Mat framed;
  cv::copyMakeBorder(slice, framed, kMargin_px, kMargin_px + kLongestSide_px - height, kMargin_px, kMargin_px,
                     cv::BORDER_CONSTANT, cv::Scalar());
  write(plane.left, 6, kMargin_px + height / 2, &framed);
  write(plane.right, kMargin_px + width + 6, kMargin_px + height / 2, &framed);
  write(plane.top, kMargin_px + width / 2, 17, &framed);
  write(plane.bottom, kMargin_px + width / 2, kMargin_px + height + 17, &framed);
  write(plane.name, 2, 17, &framed);
  return framed;
}

}  // namespace

cv::Mat threePlanes(const Volume& ct) {
  const Box box = boxOf(ct.grid);
  const double pixel_mm = (box.high - box.low).maxCoeff() / kLongestSide_px;
  std::vector<cv::Mat> pictures;
  for (const Plane& plane : kPlanes) pictures.push_back(drawn(ct, box, plane, pixel_mm));
  cv::Mat all;
  cv::hconcat(pictures, all);
  return all;
}

}  // namespace xray_registration::tools

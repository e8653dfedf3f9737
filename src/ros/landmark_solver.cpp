#include "landmark_solver.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "xray_registration/image/landmark_place.h"
#include "xray_registration/image/straight_pixel.h"
#include "xray_registration/pipeline/frame_maker.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

constexpr double kTfTimeout_s = 0.5;  // Somebody waits for the answer.

std::string viewInWords(const std::string& name) { return name.empty() ? "the X-ray" : "view '" + name + "'"; }

void requirePixelInImage(const SeenPoint& point, std::size_t number, const XrayCamera& camera) {
  const Eigen::Vector2d& pixel = point.pixel;
  // Written so that what is not finite is left to the solver, which says so.
  const bool outside =
      pixel.x() < -0.5 || pixel.y() < -0.5 || pixel.x() > camera.width - 0.5 || pixel.y() > camera.height - 0.5;
  if (!outside) return;
  char text[128];
  std::snprintf(text, sizeof text, "the pixel (%.1f, %.1f) of point number %zu lies outside of the image of %d x %d",
                pixel.x(), pixel.y(), number + 1, camera.width, camera.height);
  throw std::invalid_argument(text);
}

/// Points that several views show have one name.
void nameShared(std::vector<Landmark>* landmarks) {
  for (std::size_t i = 0; i < landmarks->size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      Landmark& first = (*landmarks)[j];
      Landmark& again = (*landmarks)[i];
      if (first.view == again.view || first.point_ct != again.point_ct) continue;
      if (first.name.empty()) first.name = std::to_string(j + 1);
      again.name = first.name;
      break;
    }
  }
}

}  // namespace

LandmarkSolver::LandmarkSolver(const NodeParameters& parameters, const Transforms* transforms)
    : transforms_(transforms), names_(parameters.viewNames()), infos_(names_.size()) {
  for (const std::string& name : names_) maps_.push_back(undistortionMapOf(parameters.image, name));
}

void LandmarkSolver::takeInfo(std::size_t view, const sensor_msgs::CameraInfoConstPtr& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  infos_[view] = info;
}

sensor_msgs::CameraInfoConstPtr LandmarkSolver::infoOf(std::size_t view) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!infos_[view]) throw std::runtime_error("no camera_info of " + viewInWords(names_[view]) + " has come yet");
  return infos_[view];
}

std::size_t LandmarkSolver::viewNumber(const std::string& name) const {
  if (name.empty()) return 0;
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found != names_.end()) return static_cast<std::size_t>(found - names_.begin());
  std::string known;
  for (const std::string& one : names_) known += (known.empty() ? "" : ", ") + one;
  throw std::invalid_argument("there is no view '" + name + "'; the parameter views has " +
                              (known.empty() ? "none" : known));
}

LandmarkView LandmarkSolver::cameraOf(std::size_t view, const std::string& first_frame) const {
  const sensor_msgs::CameraInfoConstPtr info = infoOf(view);
  LandmarkView result;
  result.camera = xray_registration::cameraOf(calibration(*info));
  if (view == 0) return result;
  std::string why;
  const std::optional<RigidTransform> T_view_first =
      transforms_->lookup(tfFrame(info->header.frame_id), first_frame, ros::Time(), kTfTimeout_s, &why);
  if (!T_view_first) throw std::runtime_error("where " + viewInWords(names_[view]) + " is, is not known: " + why);
  result.T_view_first = *T_view_first;
  return result;
}

Eigen::Vector2d LandmarkSolver::straight(const SeenPoint& point, std::size_t number, std::size_t view) const {
  const Calibration told = calibration(*infoOf(view));
  requirePixelInImage(point, number, xray_registration::cameraOf(told));
  if (!point.pixel.allFinite()) return point.pixel;
  return straightPixel(point.pixel, told, maps_[view].get());
}

SolvedLandmarks LandmarkSolver::solve(const std::vector<SeenPoint>& points,
                                      const std::optional<VolumeGrid>& ct_grid) const {
  if (!ct_grid) throw std::runtime_error("no CT is loaded that the points could be of");
  SolvedLandmarks solved;
  solved.frame_id = tfFrame(infoOf(0)->header.frame_id);
  if (solved.frame_id.empty()) throw std::runtime_error("the first view's camera_info has no frame_id");
  std::vector<LandmarkView> views;  // Only those that are looked at need be known.
  std::vector<std::size_t> places(names_.size(), names_.size());
  std::vector<Landmark> landmarks;
  const auto place_of = [&](std::size_t view) {
    if (places[view] == names_.size()) {
      places[view] = views.size();
      views.push_back(cameraOf(view, solved.frame_id));
    }
    return places[view];
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t view = viewNumber(points[i].view);
    landmarks.push_back({"", points[i].point_ct, straight(points[i], i, view), place_of(view)});
  }
  nameShared(&landmarks);
  const std::string problem = outsideOfCt(landmarks, *ct_grid);
  if (!problem.empty()) throw std::runtime_error(problem);
  if (views.empty()) views.push_back(cameraOf(0, solved.frame_id));
  solved.pose = poseFromLandmarks(landmarks, views);
  return solved;
}

}  // namespace xray_registration

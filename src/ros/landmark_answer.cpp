#include "landmark_answer.h"

#include <cstdio>

#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

std::string sizeProblem(const RegisterLandmarks::Request& request) {
  const std::size_t points = request.points_ct.size();
  if (request.pixels.size() != points) {
    return "there are " + std::to_string(points) + " points_ct and " + std::to_string(request.pixels.size()) +
           " pixels; each point needs its pixel";
  }
  if (!request.views.empty() && request.views.size() != points) {
    return "there are " + std::to_string(points) + " points and " + std::to_string(request.views.size()) +
           " views; name the view of each, or none when all are of the first";
  }
  return "";
}

std::vector<SeenPoint> seenPoints(const RegisterLandmarks::Request& request) {
  constexpr double kMillimetres = 1e3;
  std::vector<SeenPoint> points;
  for (std::size_t i = 0; i < request.points_ct.size(); ++i) {
    const geometry_msgs::Point& point = request.points_ct[i];
    points.push_back({Eigen::Vector3d(point.x, point.y, point.z) * kMillimetres,
                      {request.pixels[i].x, request.pixels[i].y},
                      request.views.empty() ? "" : request.views[i]});
  }
  return points;
}

void describe(const SolvedLandmarks& solved, RegisterLandmarks::Response* response) {
  const LandmarkPose& pose = solved.pose;
  response->pose.header.frame_id = solved.frame_id;
  response->pose.pose = toPose(pose.T_first_ct);
  response->reprojection_error = pose.rms_px;
  response->residuals = pose.residual_px;
  for (std::size_t i = 0; i < pose.used.size(); ++i) {
    if (pose.used[i]) response->inliers.push_back(static_cast<std::uint32_t>(i));
  }
  char text[128];
  std::snprintf(text, sizeof text, "%zu of %zu points agree, %.1f px off (rms); the next registration starts there",
                pose.usedCount(), pose.used.size(), pose.rms_px);
  response->message = text;
  response->success = 1;
}

}  // namespace

RegisterLandmarks::Response landmarkAnswer(const RegisterLandmarks::Request& request, const LandmarkSolver& solver,
                                           const std::optional<VolumeGrid>& ct_grid) {
  RegisterLandmarks::Response response;
  response.pose.pose.orientation.w = 1.0;
  response.message = sizeProblem(request);
  if (!response.message.empty()) return response;
  try {
    describe(solver.solve(seenPoints(request), ct_grid), &response);
  } catch (const std::exception& error) {
    response.message = error.what();
  }
  return response;
}

}  // namespace xray_registration

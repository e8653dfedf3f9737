// The pose of a CT from points of it and where X-rays show them.
#include <algorithm>
#include <cstdio>

#include "tools/common/command_line.h"
#include "tools/common/ct_source.h"
#include "tools/common/json_files.h"
#include "tools/common/yaml_files.h"
#include "tools/landmarks/points_file.h"
#include "xray_registration/image/landmark_place.h"
#include "xray_registration/image/landmark_pose.h"
#include "xray_registration/image/xray_frame.h"
#ifdef XRAY_LANDMARKS_READS_BAGS
#include "xray_registration/ros/bag_session.h"
#include "xray_registration/ros/conversions.h"
#endif

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

struct Arguments {
  CtSource ct;
  std::string camera;
  std::string bag;
  std::string views;
  std::string points;
  std::string pixels;
  std::string output;
  std::string json;
  LandmarkOptions options;
};

/// The views by their names, the first one being the frame of the pose.
struct Views {
  std::vector<std::string> names;
  std::vector<LandmarkView> views;
};

void addOptions(CLI::App& app, Arguments& arguments) {
  app.add_option("--ct", arguments.ct.path, "CT that the points are of: NIfTI, NRRD, MetaImage or a DICOM folder")
      ->required()
      ->check(CLI::ExistingPath);
  auto* camera = app.add_option("--camera", arguments.camera, "camera of the X-ray, YAML (docs/formats.md)")
                     ->check(CLI::ExistingFile);
#ifdef XRAY_LANDMARKS_READS_BAGS
  auto* bag = app.add_option("--bag", arguments.bag, "instead: a session, for its cameras and several views' poses")
                  ->check(CLI::ExistingFile)
                  ->excludes(camera);
  app.add_option("--views", arguments.views, "a,b of the bag; the first one's camera is the frame of the pose")
      ->needs(bag);
#else
  camera->required();
#endif
  app.add_option("--points", arguments.points,
                 "points of the CT: a table with their pixels (.csv), or 3D Slicer's markups (.mrk.json, .fcsv)")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--pixels", arguments.pixels, "a table (.csv) of name, u_px, v_px, view, where --points has no pixels")
      ->check(CLI::ExistingFile);
  app.add_option("--output", arguments.output, "pose of the CT in the (first) camera, YAML")->required();
  app.add_option("--inlier-px", arguments.options.inlier_px,
                 "a point that is off by more does not agree; 0: 1 % of the image's width, 3 px at least")
      ->check(CLI::Range(0.0, 10000.0))
      ->capture_default_str();
  app.add_option("--json", arguments.json, "residuals and the pose, for programs");
}

#ifdef XRAY_LANDMARKS_READS_BAGS
Views viewsOfBag(const Arguments& arguments) {
  BagSessionOptions options;
  options.views = splitList(arguments.views);
  const BagSession session(arguments.bag, options);
  Views all;
  const BagFrame frame = session.frame(0);
  for (std::size_t i = 0; i < session.views().size(); ++i) {
    const BagView& view = session.views()[i];
    const BagViewData& data = frame.views[i];
    if (!data.image || !data.camera_info)
      throw std::runtime_error(arguments.bag + ": view " + view.name + " is not in the first frame");
    const Calibration told = calibration(*data.camera_info);
    const auto is_zero = [](double value) { return value == 0.0; };
    if (!std::all_of(told.distortion.begin(), told.distortion.end(), is_zero)) {
      throw std::runtime_error(arguments.bag + ": view " + view.name +
                               " has a distortion (D); landmarks are taken from straight images");
    }
    all.names.push_back(view.name);
    all.views.push_back(
        {cameraFromCalibration(told, static_cast<int>(data.image->width), static_cast<int>(data.image->height)),
         view.T_view_first});
  }
  return all;
}
#endif

Views viewsOf(const Arguments& arguments) {
#ifdef XRAY_LANDMARKS_READS_BAGS
  if (!arguments.bag.empty()) return viewsOfBag(arguments);
  if (arguments.camera.empty()) throw ArgumentError("--camera is required, or --bag");
#endif
  return {{""}, {{readCameraFile(arguments.camera)}}};
}

std::size_t viewNumber(const Views& views, const std::string& name, const std::string& point) {
  if (name.empty() && views.names.size() == 1) return 0;
  const auto found = std::find(views.names.begin(), views.names.end(), name);
  // A single camera has no name to be told by.
  if (found == views.names.end() && views.names.size() == 1 && views.names.front().empty()) return 0;
  if (found != views.names.end()) return static_cast<std::size_t>(found - views.names.begin());
  std::string known;
  for (const std::string& one : views.names) known += (known.empty() ? "" : ", ") + one;
  throw std::runtime_error("point '" + point + "' is of view '" + name + "'; the views are " + known);
}

std::vector<FilePoint> pointsWithPixels(const Arguments& arguments) {
  std::vector<FilePoint> points = readPointsFile(arguments.points);
  if (arguments.pixels.empty()) return points;
  auto pixels = readPixelsFile(arguments.pixels);
  for (FilePoint& point : points) {
    const auto found = pixels.find(point.name);
    if (found == pixels.end()) continue;
    point.pixels = found->second;
    pixels.erase(found);
  }
  if (!pixels.empty()) {
    throw std::runtime_error(arguments.pixels + ": point '" + pixels.begin()->first + "' is not in " +
                             arguments.points);
  }
  return points;
}

std::vector<Landmark> landmarksOf(const std::vector<FilePoint>& points, const Views& views) {
  std::vector<Landmark> landmarks;
  for (const FilePoint& point : points) {
    for (const PointPixel& pixel : point.pixels) {
      landmarks.push_back({point.name, point.point_ct, pixel.pixel, viewNumber(views, pixel.view, point.name)});
    }
  }
  return landmarks;
}

/// Points that are not in the CT have other coordinates than it; those without a pixel say so as well.
void requireInCt(const std::vector<FilePoint>& points, const VolumeGrid& grid) {
  std::vector<Landmark> places;
  places.reserve(points.size());
  for (const FilePoint& point : points) places.push_back({point.name, point.point_ct, Eigen::Vector2d::Zero()});
  const std::string problem = outsideOfCt(places, grid);
  if (!problem.empty()) throw std::runtime_error(problem);
}

void print(const std::vector<Landmark>& landmarks, const LandmarkPose& pose, const Views& views) {
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    std::printf("%-20s %-10s %7.2f px%s\n", landmarks[i].name.c_str(), views.names[landmarks[i].view].c_str(),
                pose.residual_px[i], pose.used[i] ? "" : "  left out");
  }
  std::printf("%zu of %zu points agree, rms %.2f px\n", pose.usedCount(), landmarks.size(), pose.rms_px);
}

nlohmann::json report(const std::vector<Landmark>& landmarks, const LandmarkPose& pose, const Views& views) {
  nlohmann::json points = nlohmann::json::array();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    points.push_back({{"name", landmarks[i].name},
                      {"view", views.names[landmarks[i].view]},
                      {"residual_px", pose.residual_px[i]},
                      {"used", static_cast<bool>(pose.used[i])}});
  }
  return {{"T_camera_ct", toJson(pose.T_first_ct)}, {"rms_px", pose.rms_px}, {"points", points}};
}

void run(const Arguments& arguments) {
  requireWritableParent(arguments.output, "--output");
  const Views views = viewsOf(arguments);
  const auto points = pointsWithPixels(arguments);
  requireInCt(points, loadCt(arguments.ct, standardErrorLogger("landmarks", false)).grid);
  const auto landmarks = landmarksOf(points, views);
  if (landmarks.empty()) throw std::runtime_error(arguments.points + ": no point has a pixel; give --pixels");
  const LandmarkPose pose = poseFromLandmarks(landmarks, views.views, arguments.options);
  writePoseFile(arguments.output, pose.T_first_ct);
  print(landmarks, pose, views);
  if (!arguments.json.empty()) writeJson(arguments.json, report(landmarks, pose, views));
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Finds the pose of a CT from points of it and where one or several X-rays show them: four points in a view, six "
      "or more to find wrong ones, three in two views.",
      "landmarks");
  addOptions(app, arguments);
  return runTool(app, argc, argv, [&] { run(arguments); });
}

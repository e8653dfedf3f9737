#include "tools/calibrate/session/calibrated_session.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "tools/calibrate/session/told_session.h"
#include "tools/common/json_files.h"
#include "tools/common/yaml_files.h"
#include "xray_registration/common/names.h"
#include "xray_registration/geometry/angles.h"

namespace xray_registration::tools {
namespace {

/// "1.9960 ± 0.0004". What is not determined is held at what was told, and σ is what the X-rays leave open.
void printRow(const char* name, double told, double found, double sigma, bool determined, const char* unit) {
  std::printf("  %-28s %12.4f %12.4f ± %-9.2g %s%s\n", name, told, found, sigma, unit,
              determined ? "" : ", not determined: held");
}

double firstOf(const std::vector<double>& numbers) { return numbers.empty() ? 0.0 : numbers.front(); }

void printCamera(const CalibratedSessionView& view) {
  const CalibratedView& found = view.found;
  const Calibration after = view.calibration();
  const bool focal = found.isDetermined("focal_length");
  const bool centre = found.isDetermined("principal_point");
  const double sensor_px = std::max(view.told.binning_x, 1);
  printRow("focal length fx", view.told.k[0], after.k[0], after.k[0] * found.sigma.focal_scale, focal, "px");
  printRow("focal length fy", view.told.k[4], after.k[4], after.k[4] * found.sigma.focal_scale, focal, "px");
  printRow("principal point cx", view.told.k[2], after.k[2], sensor_px * found.sigma.centre_px, centre, "px");
  printRow("principal point cy", view.told.k[5], after.k[5], sensor_px * found.sigma.centre_px, centre, "px");
  printRow("radial distortion k1", firstOf(view.told.distortion), firstOf(after.distortion), found.sigma.radial,
           found.isDetermined("distortion"), "");
}

void printPose(const CalibratedSessionView& view) {
  const RigidTransform told = view.T_view_first.inverse();
  const RigidTransform found = view.firstViewFromThis();
  const ViewGeometrySigma& sigma = view.found.sigma;
  std::printf("  %-28s %38.3f ± %-9.2g degrees\n", "relative pose: turned by",
              kDegreesPerRadian * rotationAngleBetween(told, found), kDegreesPerRadian * sigma.rotation_rad);
  std::printf("  %-28s %38.3f ± %-9.2g mm (± %.2g mm as seen at the CT)%s\n", "its source moved by",
              (told.translation() - found.translation()).norm(), sigma.source_mm, sigma.translation_mm,
              view.found.isDetermined("view_pose") ? "" : ", not determined");
}

std::string nameOf(const CalibratedSessionView& view) {
  return view.bag.name.empty() ? "camera" : asFileName(view.bag.name);
}

/// roslaunch takes more than names in its files: commands, and Python in $(eval ...).
void checkFrames(const std::vector<CalibratedSessionView>& views) {
  for (const CalibratedSessionView& view : views) {
    if (isFrameName(view.bag.frame_id)) continue;
    throw std::runtime_error("the images of view '" + view.bag.name + "' have the frame_id '" + view.bag.frame_id +
                             "'; a launch file can only name frames of letters, digits, and _ - . : /");
  }
}

void writeLaunch(const std::string& path, const std::vector<CalibratedSessionView>& views) {
  checkFrames(views);
  std::ofstream stream(path);
  stream.precision(12);
  stream << "<launch>\n  <!-- Where the further views' X-ray sources stand in the first view's optical frame. -->\n";
  for (std::size_t i = 1; i < views.size(); ++i) {
    const RigidTransform T = views[i].firstViewFromThis();
    const Eigen::Vector3d p = T.translation() / 1000.0;
    const Eigen::Quaterniond q(T.linear());
    stream << "  <node pkg=\"tf2_ros\" type=\"static_transform_publisher\" name=\"" << nameOf(views[i]) << "_pose\"\n"
           << "        args=\"" << p.x() << ' ' << p.y() << ' ' << p.z() << "  " << q.x() << ' ' << q.y() << ' '
           << q.z() << ' ' << q.w() << "  " << views.front().bag.frame_id << ' ' << views[i].bag.frame_id << "\"/>\n";
  }
  stream << "</launch>\n";
  if (!stream.flush()) throw std::runtime_error(path + ": cannot be written");
}

nlohmann::json toJson(const CalibratedSessionView& view) {
  const ViewGeometry& geometry = view.found.geometry;
  const ViewGeometrySigma& sigma = view.found.sigma;
  const Calibration after = view.calibration();
  const double sensor_px = std::max(view.told.binning_x, 1);
  return {{"focal_scale", geometry.focal_scale},
          {"focal_scale_sigma", sigma.focal_scale},
          {"fx", after.k[0]},
          {"fy", after.k[4]},
          {"cx", after.k[2]},
          {"cy", after.k[5]},
          {"centre_sigma_px", sensor_px * sigma.centre_px},
          {"k1", firstOf(after.distortion)},
          {"k1_sigma", sigma.radial},
          {"T_first_view", tools::toJson(view.firstViewFromThis())},
          {"rotation_sigma_deg", kDegreesPerRadian * sigma.rotation_rad},
          {"translation_sigma_mm", sigma.source_mm},
          {"translation_at_ct_sigma_mm", sigma.translation_mm},
          {"undetermined", view.found.undetermined}};
}

}  // namespace

Calibration CalibratedSessionView::calibration() const { return corrected(told, found.geometry); }

void printTable(const std::vector<CalibratedSessionView>& views) {
  std::printf("  %-28s %12s %12s   %s\n", "", "told", "calibrated", "σ");
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::printf("%s\n", views[i].bag.name.empty() ? "view" : ("view '" + views[i].bag.name + "'").c_str());
    printCamera(views[i]);
    if (i > 0) printPose(views[i]);
  }
}

std::vector<std::string> writeFiles(const std::string& folder, const std::vector<CalibratedSessionView>& views) {
  std::vector<std::string> written;
  const auto file = [&](const std::string& name) {
    written.push_back((std::filesystem::path(folder) / name).string());
    return written.back();
  };
  for (const CalibratedSessionView& view : views) {
    writeCameraFile(file(nameOf(view) + ".yaml"), nameOf(view), view.calibration());
  }
  if (views.size() > 1) writeLaunch(file("views.launch"), views);
  return written;
}

void writeReport(const std::string& path, const std::vector<CalibratedSessionView>& views,
                 const GeometryCalibration& found, std::size_t frames_tried) {
  nlohmann::json all = nlohmann::json::object();
  for (const CalibratedSessionView& view : views) all[view.bag.name] = toJson(view);
  writeJson(path, {{"views", all},
                   {"frames", found.T_camera_ct.size()},
                   {"frames_tried", frames_tried},
                   {"similarity_before", found.similarity_before},
                   {"similarity_after", found.similarity_after},
                   {"converged", found.converged}});
}

}  // namespace xray_registration::tools

#include "calibration_answer.h"

#include <algorithm>
#include <iomanip>
#include <sstream>

#include "xray_registration/geometry/angles.h"
#include "xray_registration/pipeline/corrected_views.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

sensor_msgs::CameraInfo correctedInfo(sensor_msgs::CameraInfo info, const ViewGeometry& geometry) {
  const Calibration after = corrected(calibration(info), geometry);
  std::copy(after.k.begin(), after.k.end(), info.K.begin());
  info.D = after.distortion;
  info.distortion_model = after.distortion_model;
  // The undistorted camera keeps K.
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) info.P[4 * row + column] = after.k[3 * row + column];
  }
  return info;
}

geometry_msgs::TransformStamped transformOf(const FrameMessages& told, std::size_t view, const ViewGeometry& geometry) {
  geometry_msgs::TransformStamped transform;
  transform.header = told.views.front().image->header;
  transform.child_frame_id = told.views[view].image->header.frame_id;
  transform.transform = toTransform(geometry.T_view_first.inverse());
  return transform;
}

/// "'ap': focal length 1.98 ± 0.02 % longer than told, …"
std::string inWords(const std::string& name, const CalibratedView& view, const RigidTransform* T_view_first_told) {
  const ViewGeometry& found = view.geometry;
  std::ostringstream text;
  text << std::setprecision(2) << std::fixed << (name.empty() ? "" : "'" + name + "': ");
  if (view.isDetermined("focal_length")) {
    text << "focal length " << 100.0 * (found.focal_scale - 1.0) << " ± " << 100.0 * view.sigma.focal_scale
         << " % longer than told, ";
  }
  if (view.isDetermined("principal_point")) {
    text << "principal point moved by (" << found.centre_shift_px.x() << ", " << found.centre_shift_px.y() << ") ± "
         << view.sigma.centre_px << " px, ";
  }
  if (view.isDetermined("distortion") && found.radial != 0.0) text << "k1 " << found.radial << " more, ";
  if (T_view_first_told != nullptr) {
    text << "pose turned by " << kDegreesPerRadian * rotationAngleBetween(found.T_view_first, *T_view_first_told)
         << " ± " << kDegreesPerRadian * view.sigma.rotation_rad << " degrees, its source ± " << view.sigma.source_mm
         << " mm, ";
  }
  std::string words = text.str();
  if (!view.undetermined.empty()) {
    words += "not determined by the X-rays:";
    for (const std::string& what : view.undetermined) words += ' ' + what;
    return words;
  }
  return words.substr(0, words.size() - 2);
}

}  // namespace

Calibrate::Response calibrationAnswer(const std::vector<std::string>& names, const FrameMessages& told,
                                      const GeometryCalibration& found,
                                      const std::vector<RigidTransform>& T_view_first) {
  Calibrate::Response answer;
  answer.success = 1;
  answer.frames = static_cast<std::uint32_t>(found.T_camera_ct.size());
  answer.similarity_before = found.similarity_before;
  answer.similarity_after = found.similarity_after;
  answer.message = found.converged ? "" : "the solution did not come to rest; ";
  for (std::size_t i = 0; i < found.views.size(); ++i) {
    const CalibratedView& view = found.views[i];
    answer.views.push_back(names[i]);
    answer.camera_infos.push_back(correctedInfo(*told.views[i].info, view.geometry));
    if (i > 0) answer.transforms.push_back(transformOf(told, i, view.geometry));
    std::string undetermined;
    for (const std::string& what : view.undetermined) undetermined += ' ' + what;
    if (!undetermined.empty()) answer.undetermined.push_back((names[i].empty() ? "" : names[i] + ':') + undetermined);
    answer.message += (i > 0 ? "; " : "") + inWords(names[i], view, i > 0 ? &T_view_first[i] : nullptr);
  }
  return answer;
}

}  // namespace xray_registration

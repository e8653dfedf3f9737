#include "tools/simulate_session/dicom_output.h"

#include <cmath>
#include <filesystem>
#include <utility>

#include "tools/common/command_line.h"
#include "xray_registration/image/xray_dicom_geometry.h"

namespace xray_registration::tools {
namespace {

/// A view's angle says where the source is, from in front of the patient on; a positioner's where the detector is.
double primaryAngle(double view_deg) { return std::remainder(view_deg + 180.0, 360.0); }

}  // namespace

DicomOutput::DicomOutput(std::string folder, const SessionGenerator& generator, double frame_time_s)
    : folder_(std::move(folder)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (!std::filesystem::is_directory(folder_))
    throw ArgumentError("--dicom " + folder_ + ": the folder cannot be made");
  const SessionSetup& setup = generator.setup();
  for (const ViewSetup& view : setup.views) {
    XrayAngiogram run;
    run.frame_time_s = frame_time_s;
    run.pixel_mm = setup.detector_mm / setup.image_size;
    run.source_detector_mm = setup.source_detector_mm;
    run.source_isocentre_mm = setup.source_centre_mm;
    run.primary_deg = primaryAngle(view.angle_deg);
    run.collimator_radius_px = setup.physics.collimator_radius_px;
    run.number = static_cast<int>(runs_.size()) + 1;
    names_.push_back(view.name);
    runs_.push_back(std::move(run));
  }
}

void DicomOutput::add(std::size_t view, Image<std::uint16_t> xray) {
  mirrorColumns(&xray);
  runs_.at(view).frames.push_back(std::move(xray));
}

void DicomOutput::write() const {
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    writeXrayAngiogram((std::filesystem::path(folder_) / (names_[i] + ".dcm")).string(), runs_[i]);
  }
}

}  // namespace xray_registration::tools

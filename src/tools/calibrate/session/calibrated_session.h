#pragma once

#include <string>
#include <vector>

#include "xray_registration/image/xray_frame.h"
#include "xray_registration/registration/geometry_calibration.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// One view before and after.
struct CalibratedSessionView {
  BagView bag;                  ///< T_view_first as the bag has it.
  Calibration told;             ///< The bag's, or a wrong one for a test.
  RigidTransform T_view_first;  ///< As told.
  CalibratedView found;

  Calibration calibration() const;                                                            ///< Corrected.
  RigidTransform firstViewFromThis() const { return found.geometry.T_view_first.inverse(); }  ///< Corrected.
};

/// What is printed: told, found, σ, for each view.
void printTable(const std::vector<CalibratedSessionView>& views);

/// <folder>/<view>.yaml as camera_info_manager reads it, for each view ("camera.yaml" for one without a name), and, for
/// several views, <folder>/views.launch, which publishes their relative poses. Returns the files' names.
std::vector<std::string> writeFiles(const std::string& folder, const std::vector<CalibratedSessionView>& views);

/// --json
void writeReport(const std::string& path, const std::vector<CalibratedSessionView>& views,
                 const GeometryCalibration& found, std::size_t frames_tried);

}  // namespace xray_registration::tools

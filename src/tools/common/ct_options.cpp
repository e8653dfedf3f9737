#include "tools/common/ct_options.h"

namespace xray_registration::tools {

void addCtReadOptions(CLI::App& app, VolumeReadOptions* options) {
  const CLI::Validator orientation(
      [](const std::string& letters) {
        return isOrientation(letters) ? std::string() : "'" + letters + "' is not three letters such as RAS or LPS";
      },
      "LETTERS");
  app.add_option("--series-uid", options->series_uid, "DICOM series to take; default: the one with most slices");
  app.add_option("--hu-slope", options->hu_slope, "HU = hu-slope * value in the CT's file + hu-intercept")
      ->capture_default_str();
  app.add_option("--hu-intercept", options->hu_intercept, "see --hu-slope")->capture_default_str();
  app.add_option("--padding", options->padding, "value in the file that marks voxels without one; they become air");
  app.add_option("--orientation", options->orientation, "where x, y, z of a CT that does not say point, e.g. RAS")
      ->check(orientation);
  app.add_option("--unit-mm", options->unit_mm, "millimetres of the file's unit of length; 0: as the file says")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_flag("!--no-value-check", options->check_values,
               "only warn of values that look like no Hounsfield units (docs/ct_files.md)");
}

}  // namespace xray_registration::tools

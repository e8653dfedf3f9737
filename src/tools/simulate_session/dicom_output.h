#pragma once

#include <string>
#include <vector>

#include "tools/common/session_generator.h"
#include "xray_registration/image/xray_dicom_writer.h"

namespace xray_registration::tools {

/// Collects the X-rays of a session and writes them as a C-arm would: <folder>/<view>.dcm, a run of the XA kind for
/// each view, its pictures as seen from the detector.
class DicomOutput {
 public:
  /// Makes the folder. @throws ArgumentError when it cannot be made.
  DicomOutput(std::string folder, const SessionGenerator& generator, double frame_time_s);

  /// Of view number `view`, as the generator makes it, as seen from the source.
  void add(std::size_t view, Image<std::uint16_t> xray);

  /// @throws XrayDicomError when a file cannot be written.
  void write() const;

 private:
  std::string folder_;
  std::vector<std::string> names_;
  std::vector<XrayAngiogram> runs_;
};

}  // namespace xray_registration::tools

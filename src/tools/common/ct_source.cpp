#include "tools/common/ct_source.h"

#include <cmath>

#include "tools/common/command_line.h"
#include "xray_registration/volume/phantom.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration::tools {

namespace {

void checkSpacing(double spacing_mm) {
  if (spacing_mm >= 0.4 && spacing_mm <= 10.0) return;
  throw ArgumentError("phantom spacing " + std::to_string(spacing_mm) + " mm: allowed are 0.4 to 10 mm");
}

}  // namespace

Volume loadCt(const CtSource& source, const Logger& logger) {
  if (!source.path.empty()) return readVolume(source.path, source.read, logger);
  if (source.phantom.empty()) throw ArgumentError("no CT: name a file or a phantom (head, pelvis, cube)");
  checkSpacing(source.spacing_mm);
  if (source.phantom == "head") return headPhantom(source.spacing_mm);
  if (source.phantom == "pelvis") return pelvisPhantom(source.spacing_mm);
  if (source.phantom == "cube") return whiteCube(static_cast<int>(std::lround(100.0 / source.spacing_mm)));
  throw ArgumentError("unknown phantom '" + source.phantom + "': there are head, pelvis and cube");
}

LabelledPhantom loadLabelledPhantom(const CtSource& source) {
  checkSpacing(source.spacing_mm);
  if (source.phantom == "head") return labelledHeadPhantom(source.spacing_mm);
  if (source.phantom == "pelvis") return labelledPelvisPhantom(source.spacing_mm);
  throw ArgumentError("the phantom '" + source.phantom + "' has no labels of bones: head and pelvis have");
}

}  // namespace xray_registration::tools

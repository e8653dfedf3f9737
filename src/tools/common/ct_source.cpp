#include "tools/common/ct_source.h"

#include <cmath>

#include "tools/common/command_line.h"
#include "xray_registration/volume/phantom.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration::tools {

Volume loadCt(const CtSource& source, const Logger& logger) {
  if (!source.path.empty()) return readVolume(source.path, {}, logger);
  if (source.phantom.empty()) throw ArgumentError("no CT: name a file or a phantom (head, pelvis, cube)");
  if (!(source.spacing_mm >= 0.4 && source.spacing_mm <= 10.0)) {
    throw ArgumentError("phantom spacing " + std::to_string(source.spacing_mm) + " mm: allowed are 0.4 to 10 mm");
  }
  if (source.phantom == "head") return headPhantom(source.spacing_mm);
  if (source.phantom == "pelvis") return pelvisPhantom(source.spacing_mm);
  if (source.phantom == "cube") return whiteCube(static_cast<int>(std::lround(100.0 / source.spacing_mm)));
  throw ArgumentError("unknown phantom '" + source.phantom + "': there are head, pelvis and cube");
}

}  // namespace xray_registration::tools

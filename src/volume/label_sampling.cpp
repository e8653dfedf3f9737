#include "label_sampling.h"

#include "xray_registration/volume/volume_error.h"

namespace xray_registration {

void checkLabels(const LabelVolume& labels) {
  if (labels.labels.empty() || labels.labels.size() != labels.grid.voxelCount()) {
    throw VolumeError("ct/mask: the number of labels does not fit the grid");
  }
}

}  // namespace xray_registration

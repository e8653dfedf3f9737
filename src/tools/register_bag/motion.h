#pragma once

#include <string>
#include <vector>

#include "tools/register_bag/frame_record.h"
#include "tools/register_bag/motion_table.h"
#include "xray_registration/common/log.h"

namespace xray_registration::tools {

/// The columns for what the pipeline follows. `knee`: "femur,tibia[,side]", or empty.
/// Anatomical frames of the knee: of a CT's axes (LPS), with the origin halfway between both bodies' centres where both
/// are cut out of one CT, else at each body's centre; of a mesh, its own axes and origin.
/// @throws ArgumentError naming --knee.
TableSetup tableSetup(const RegistrationPipeline& pipeline, const std::string& knee, const Logger& logger);

/// What the table takes of the frames.
std::vector<TableFrame> tableFrames(const std::vector<FrameRecord>& records);

}  // namespace xray_registration::tools

#pragma once

#include <map>
#include <string>
#include <vector>

namespace xray_registration {

/// Label values by the names of the segments, from a segmentation that 3D Slicer saved (.seg.nrrd, or any NRRD with its
/// keys). Empty for every other file, which has labels without names. When `directory` is not empty, the file must lie
/// below it.
/// @throws VolumeError naming the file when segments overlap and therefore stand in layers, when two labelled segments
/// have one name or a label value is no number, or when it cannot be read.
std::map<std::string, int> segmentNames(const std::string& path, const std::string& directory = "");

/// The labels with these names in a label image.
/// @throws VolumeError as segmentNames does, and naming the file, the name, and what names there are.
std::vector<int> labelsNamed(const std::vector<std::string>& names, const std::string& path,
                             const std::string& directory = "");

}  // namespace xray_registration

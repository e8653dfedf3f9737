#pragma once

#include <string>

namespace xray_registration {

/// Whether it is one part of a ROS name: a letter, then letters, digits and _ of ASCII. Such a name may stand in
/// topics, tables and file names as it is. At most 100 characters.
bool isName(const std::string& text);

/// Whether it is a ROS name below which topics may stand: parts of letters, digits and _ with a / between them, one
/// before them if need be, and a letter first. At most 250 characters.
bool isNamePath(const std::string& text);

/// A name path as the name of a file: with _ for each /.
std::string asFileName(std::string name_path);

/// Whether tf2 and a launch file may have it as the name of a frame: letters, digits, and _ - . : /. At most 250
/// characters.
bool isFrameName(const std::string& text);

}  // namespace xray_registration

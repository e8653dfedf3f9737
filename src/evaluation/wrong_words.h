#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace xray_registration {

/// What the text of a wrong input is made of. All throw std::invalid_argument with what is wrong with a word.

using Strings = std::vector<std::string>;

[[noreturn]] void refuse(const std::string& message);

/// Empty text gives no part.
Strings splitAt(char separator, const std::string& text);

std::string joined(const Strings& names);

/// "2mm" with the unit "mm" → 2; the unit may be left out.
double number(const std::string& text, const std::string& unit, double lowest, double highest);

bool startsWith(const std::string& start, const std::string& text);

/// "seed7" → 7, at `position`, or 1 where the words end before.
std::uint64_t seedAt(std::size_t position, const Strings& words);

/// "x", "y" or "z".
Eigen::Vector3d axisNamed(const std::string& name);

}  // namespace xray_registration

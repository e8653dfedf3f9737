#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "xray_registration/common/log.h"

namespace xray_registration::tools {

/// Exit codes of every tool.
constexpr int kDone = 0;
constexpr int kWorkFailed = 1;
constexpr int kWrongArguments = 2;

/// The arguments are wrong in a way that only the tool can see: exit code 2.
class ArgumentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Parses the arguments and runs `work`. Every failure becomes one line on standard error, `<tool>: <what>`, and the
/// exit code that fits: 1 when the work failed, 2 when the arguments are wrong.
int runTool(CLI::App& app, int argc, char** argv, const std::function<void()>& work);

/// Writes warnings and errors to standard error, and the rest too when `verbose`.
Logger standardErrorLogger(const std::string& tool, bool verbose);

/// "a,b,c" → {a, b, c}; empty text gives no element.
std::vector<std::string> splitList(const std::string& text, char separator = ',');

/// A number that fills the whole text.
/// @throws ArgumentError naming `what` otherwise.
double parseNumber(const std::string& text, const std::string& what);

/// "a,b" → two finite numbers. @throws ArgumentError naming `what`.
std::pair<double, double> parsePair(const std::string& text, const std::string& what);

/// @throws ArgumentError when the folder that the file would go to does not exist.
void requireWritableParent(const std::string& file, const std::string& what);

}  // namespace xray_registration::tools

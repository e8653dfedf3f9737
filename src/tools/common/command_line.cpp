#include "tools/common/command_line.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include "xray_registration/common/frame_memory.h"

namespace xray_registration::tools {
namespace {

int report(const CLI::App& app, const std::string& what, int code) {
  std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), escaped(what).c_str());
  return code;
}

}  // namespace

int runTool(CLI::App& app, int argc, char** argv, const std::function<void()>& work) {
  keepMemoryBetweenFrames();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help
    return report(app, std::string(error.what()) + " (see --help)", kWrongArguments);
  }
  try {
    work();
  } catch (const ArgumentError& error) {
    return report(app, error.what(), kWrongArguments);
  } catch (const std::exception& error) {
    return report(app, error.what(), kWorkFailed);
  }
  return kDone;
}

Logger standardErrorLogger(const std::string& tool, bool verbose) {
  return [tool, verbose](LogLevel level, const std::string& text) {
    if (!verbose && (level == LogLevel::kDebug || level == LogLevel::kInfo)) return;
    const char* mark = level == LogLevel::kWarning ? "warning: " : level == LogLevel::kError ? "error: " : "";
    std::fprintf(stderr, "%s: %s%s\n", tool.c_str(), mark, text.c_str());
  };
}

std::vector<std::string> splitList(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

double parseNumber(const std::string& text, const std::string& what) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size() || !std::isfinite(value)) {
    throw ArgumentError(what + ": '" + text + "' is not a number");
  }
  return value;
}

std::pair<double, double> parsePair(const std::string& text, const std::string& what) {
  const auto parts = splitList(text);
  if (parts.size() != 2) throw ArgumentError(what + ": '" + text + "' is not two numbers as 'a,b'");
  return {parseNumber(parts[0], what), parseNumber(parts[1], what)};
}

void requireWritableParent(const std::string& file, const std::string& what) {
  const auto parent = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::is_directory(parent)) {
    throw ArgumentError(what + " " + file + ": the folder " + parent.string() + " does not exist");
  }
}

}  // namespace xray_registration::tools

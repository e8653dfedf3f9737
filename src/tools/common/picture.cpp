#include "tools/common/picture.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

namespace xray_registration::tools {
namespace {

/// The exit code, or 128 and more when a signal ended it, as in a shell.
int exitCodeOf(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) == -1 && errno == EINTR) continue;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

void drawPicture(const std::string& kind, const std::string& picture, const std::string& report) {
  namespace fs = std::filesystem;
  const fs::path script = fs::read_symlink("/proc/self/exe").parent_path() / "plot_results";
  std::vector<std::string> words = {script, kind, fs::absolute(picture), fs::absolute(report)};
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  if (const int failed = posix_spawn(&child, script.c_str(), nullptr, nullptr, arguments.data(), environ)) {
    throw std::runtime_error(picture + ": " + script.string() + " cannot be run: " + std::strerror(failed));
  }
  if (exitCodeOf(child) != 0) {
    throw std::runtime_error(picture + " was not drawn; once that is mended, 'rosrun xray_registration plot_results " +
                             kind + " " + picture + " " + report + "' draws it");
  }
}

}  // namespace xray_registration::tools

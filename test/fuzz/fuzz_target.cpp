#include "test/fuzz/fuzz_target.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "xray_registration/common/escaped.h"

namespace xray_registration::fuzz {
namespace {

class ScratchFolder {
 public:
  ScratchFolder() {
    // Memory, where there is such a folder: it is written for every input.
    const char* memory = "/dev/shm";
    const auto parent =
        access(memory, W_OK) == 0 ? std::filesystem::path(memory) : std::filesystem::temp_directory_path();
    std::string name = (parent / "xray_registration_fuzz_XXXXXX").string();
    require(mkdtemp(name.data()) != nullptr, "a folder for the inputs can be made");
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

void requireWords(const std::string& refusal) {
  require(!refusal.empty(), "a refusal has words");
  require(refusal == escaped(refusal), "a refusal is one line without orders to a terminal");
}

std::string fileOf(const std::string& content, const std::string& name) {
  static const ScratchFolder folder;
  std::string path = (folder.path() / name).string();
  std::ofstream stream(path, std::ios::binary);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  require(static_cast<bool>(stream.flush()), "the input can be written");
  return path;
}

}  // namespace xray_registration::fuzz

#include "tools/common/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace xray_registration::tools {

ProgressBar::ProgressBar(std::string title, std::size_t total)
    : title_(std::move(title)), total_(std::max<std::size_t>(total, 1)), visible_(isatty(STDERR_FILENO) != 0) {
  advanceTo(0);
}

ProgressBar::~ProgressBar() {
  if (visible_) std::fprintf(stderr, "\r\033[K");
}

void ProgressBar::advanceTo(std::size_t done) {
  if (!visible_) return;
  constexpr std::size_t kWidth = 40;
  const std::size_t filled = std::min(done, total_) * kWidth / total_;
  std::fprintf(stderr, "\r%s [%s%s] %zu/%zu", title_.c_str(), std::string(filled, '#').c_str(),
               std::string(kWidth - filled, '.').c_str(), done, total_);
  std::fflush(stderr);
}

}  // namespace xray_registration::tools

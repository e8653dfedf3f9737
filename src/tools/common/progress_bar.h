#pragma once

#include <cstddef>
#include <string>

namespace xray_registration::tools {

/// One line on standard error that fills as the work goes on. Silent when standard error is not a terminal.
class ProgressBar {
 public:
  ProgressBar(std::string title, std::size_t total);
  ~ProgressBar();  ///< Removes the line.
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void advanceTo(std::size_t done);

 private:
  std::string title_;
  std::size_t total_;
  bool visible_;
};

}  // namespace xray_registration::tools

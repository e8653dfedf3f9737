#pragma once

#include <memory>

namespace xray_registration {

/// While one lives, ITK and GDCM write nothing to standard error; they do so past the logger, GDCM with what stands in
/// the file. The switches are the libraries' own and hold for the process, hence one reader at a time.
class QuietItk {
 public:
  QuietItk();
  ~QuietItk();
  QuietItk(const QuietItk&) = delete;
  QuietItk& operator=(const QuietItk&) = delete;

  /// GDCM reads a file whose pixels are cut off, and only says so.
  bool pixelsWereIncomplete() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace xray_registration

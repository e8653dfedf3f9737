#pragma once

#include <stdexcept>
#include <string>

namespace xray_registration {

/// The text as a log, a terminal or a status message may show it, whoever wrote it (a file's name, a message's
/// frame_id, an attribute of DICOM): on one line, in UTF-8, without orders to a terminal. Control characters become \n,
/// \r, \t or \x1b, bytes that are no UTF-8 \xff, characters that break lines or turn the direction of writing
/// \u202e. A backslash stays as it is, so that it may be escaped again and again without a change. Any thread.
std::string escaped(const std::string& text);

/// The same with blanks in place of line breaks and tabs: for what libraries say, in several lines.
std::string onOneLine(std::string text);

/// An error whose message is escaped: it names files, or repeats what stood in one.
class EscapedError : public std::runtime_error {
 public:
  explicit EscapedError(const std::string& message) : std::runtime_error(escaped(message)) {}
};

}  // namespace xray_registration

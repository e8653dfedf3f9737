#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace xray_registration {

/// The types of numbers in mesh files.
enum class NumberType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64, kFloat, kDouble };

std::size_t bytesOf(NumberType type);

/// Reads words, lines and numbers of a file in memory, in order.
class MeshScanner {
 public:
  enum class Encoding { kAscii, kLittleEndian, kBigEndian };

  MeshScanner(const std::string& bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  /// How numbers are written from here on.
  void setEncoding(Encoding encoding) { encoding_ = encoding; }

  /// The next word, across lines; empty at the end.
  std::string word();

  /// What is left of the line, without its end and blanks around it.
  std::string line();

  bool atEnd() const { return position_ >= bytes_.size(); }
  std::size_t bytesLeft() const { return bytes_.size() - position_; }

  /// A number as the encoding says. @throws VolumeError when there is none.
  double number(NumberType type);

  /// An index or a count. @throws VolumeError when it is negative, not whole or above `largest`.
  std::uint64_t count(NumberType type, std::uint64_t largest);

  /// A count of things that take `bytes_each` at least: more than the rest of the file can hold is refused.
  std::uint64_t countThatFits(std::uint64_t count, std::size_t bytes_each) const;

 private:
  double asciiNumber();

  const std::string& bytes_;
  const std::string& path_;
  std::size_t position_ = 0;
  Encoding encoding_ = Encoding::kAscii;
};

}  // namespace xray_registration

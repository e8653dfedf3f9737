#include "mesh_scanner.h"

#include <locale.h>
#include <stdlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

#include "mesh_readers.h"

namespace xray_registration {
namespace {

bool isBlank(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

// Files have a decimal point, whatever the process' locale.
class CLocale {
 public:
  CLocale() : locale_(newlocale(LC_NUMERIC_MASK, "C", nullptr)) {}
  ~CLocale() { freelocale(locale_); }
  CLocale(const CLocale&) = delete;
  CLocale& operator=(const CLocale&) = delete;
  double parse(const char* text, char** end) const { return strtod_l(text, end, locale_); }

 private:
  locale_t locale_;
};

template <typename T>
double valueOf(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

double valueOf(const char* bytes, NumberType type) {
  switch (type) {
    case NumberType::kInt8:
      return valueOf<std::int8_t>(bytes);
    case NumberType::kUint8:
      return valueOf<std::uint8_t>(bytes);
    case NumberType::kInt16:
      return valueOf<std::int16_t>(bytes);
    case NumberType::kUint16:
      return valueOf<std::uint16_t>(bytes);
    case NumberType::kInt32:
      return valueOf<std::int32_t>(bytes);
    case NumberType::kUint32:
      return valueOf<std::uint32_t>(bytes);
    case NumberType::kInt64:
      return valueOf<std::int64_t>(bytes);
    case NumberType::kUint64:
      return valueOf<std::uint64_t>(bytes);
    case NumberType::kFloat:
      return valueOf<float>(bytes);
    case NumberType::kDouble:
      break;
  }
  return valueOf<double>(bytes);
}

bool machineIsLittleEndian() {
  const std::uint16_t one = 1;
  char first = 0;
  std::memcpy(&first, &one, 1);
  return first == 1;
}

}  // namespace

std::size_t bytesOf(NumberType type) {
  switch (type) {
    case NumberType::kInt8:
    case NumberType::kUint8:
      return 1;
    case NumberType::kInt16:
    case NumberType::kUint16:
      return 2;
    case NumberType::kInt32:
    case NumberType::kUint32:
    case NumberType::kFloat:
      return 4;
    default:
      return 8;
  }
}

std::string MeshScanner::word() {
  while (position_ < bytes_.size() && isBlank(bytes_[position_])) ++position_;
  const std::size_t begin = position_;
  while (position_ < bytes_.size() && !isBlank(bytes_[position_])) ++position_;
  return bytes_.substr(begin, position_ - begin);
}

std::string MeshScanner::line() {
  const std::size_t end = std::min(bytes_.find('\n', position_), bytes_.size());
  std::size_t first = position_;
  std::size_t last = end;
  position_ = std::min(end + 1, bytes_.size());
  while (first < last && isBlank(bytes_[first])) ++first;
  while (last > first && isBlank(bytes_[last - 1])) --last;
  return bytes_.substr(first, last - first);
}

double MeshScanner::asciiNumber() {
  static const CLocale c_locale;
  const std::string text = word();
  char* end = nullptr;
  const double value = c_locale.parse(text.c_str(), &end);
  if (text.empty()) refuseMesh(path_, "it ends where a number should follow; it is truncated");
  if (*end != '\0') refuseMesh(path_, "'" + text.substr(0, 20) + "' stands where a number should");
  return value;
}

double MeshScanner::number(NumberType type) {
  if (encoding_ == Encoding::kAscii) return asciiNumber();
  const std::size_t size = bytesOf(type);
  if (bytesLeft() < size) refuseMesh(path_, "it ends where a number should follow; it is truncated");
  char bytes[8];
  std::memcpy(bytes, bytes_.data() + position_, size);
  position_ += size;
  if ((encoding_ == Encoding::kLittleEndian) != machineIsLittleEndian()) std::reverse(bytes, bytes + size);
  return valueOf(bytes, type);
}

std::uint64_t MeshScanner::count(NumberType type, std::uint64_t largest) {
  const double value = number(type);
  if (!(value >= 0.0 && value <= static_cast<double>(largest)) || value != std::floor(value)) {
    refuseMesh(path_, "an index or a count in it is " + std::to_string(value) + ", at most " + std::to_string(largest) +
                          " makes sense; it is damaged");
  }
  return static_cast<std::uint64_t>(value);
}

std::uint64_t MeshScanner::countThatFits(std::uint64_t count, std::size_t bytes_each) const {
  if (count > bytesLeft() / std::max<std::size_t>(1, bytes_each)) {
    refuseMesh(path_, "its header states " + std::to_string(count) + " entries, more than the file holds; it is " +
                          "truncated or damaged");
  }
  return count;
}

}  // namespace xray_registration

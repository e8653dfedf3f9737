#include "bag_message.h"

#include <cstring>

namespace xray_registration {
namespace {

constexpr std::uint64_t kStamp = 12;      // A header's number and time.
constexpr std::uint64_t kTransform = 56;  // Its vector and quaternion.

// Walks over a message; once it has left it, it stays outside.
class Cursor {
 public:
  Cursor(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  bool fits() const { return fits_; }

  void skip(std::uint64_t bytes) {
    if (!fits_ || bytes > size_ - place_) {
      fits_ = false;
      return;
    }
    place_ += bytes;
  }

  std::uint32_t count() {
    std::uint32_t value = 0;
    const std::uint64_t here = place_;
    skip(sizeof value);
    if (fits_) std::memcpy(&value, data_ + here, sizeof value);
    return value;
  }

  void text() { skip(count()); }
  void doubles() { skip(std::uint64_t{count()} * sizeof(double)); }

  void header() {
    skip(kStamp);
    text();
  }

  void transforms() {
    for (std::uint32_t left = count(); left > 0 && fits_; --left) {
      header();
      text();  // The child's frame.
      skip(kTransform);
    }
  }

 private:
  const std::uint8_t* data_;
  std::uint64_t size_;
  std::uint64_t place_ = 0;
  bool fits_ = true;
};

}  // namespace

bool messageFits(const char* layout, const std::uint8_t* data, std::size_t size) {
  Cursor cursor(data, size);
  for (const char* part = layout; *part != '\0'; ++part) {
    if (*part == 'h') {
      cursor.header();
    } else if (*part == 's' || *part == 'b') {
      cursor.text();
    } else if (*part == 'd') {
      cursor.doubles();
    } else if (*part == 't') {
      cursor.transforms();
    } else {
      cursor.skip(static_cast<std::uint64_t>(*part - '0'));
    }
  }
  return cursor.fits();
}

}  // namespace xray_registration

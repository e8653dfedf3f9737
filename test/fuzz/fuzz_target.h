#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

/// What a fuzzer, and the replay of its corpus, call with one input. Returns 0. Whatever the input is, it is read or
/// refused by the errors that the reader documents; anything else ends the process, or leaves by an exception.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace xray_registration::fuzz {

/// Ends the process with `what` when a promise of the code is broken.
void require(bool holds, const char* what);

/// Also that the words of a refusal may stand in a log: one line, no orders to a terminal.
void requireWords(const std::string& refusal);

/// Takes an input apart, from its beginning. Beyond its end there are zeros and empty texts.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  template <typename T>
  T take() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    const std::size_t count = std::min(sizeof(T), left());
    std::memcpy(&value, data_ + position_, count);
    position_ += count;
    return value;
  }

  /// As many bytes as there are, up to `most`.
  std::string text(std::size_t most) {
    const std::size_t count = std::min(most, left());
    std::string result(reinterpret_cast<const char*>(data_) + position_, count);
    position_ += count;
    return result;
  }
  std::string rest() { return text(left()); }

  std::size_t left() const { return size_ - position_; }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t position_ = 0;
};

/// A file with the content of the input, for readers that take a path. Its folder goes when the process ends.
/// @param name  With the ending that the reader looks at.
std::string fileOf(const std::string& content, const std::string& name);

}  // namespace xray_registration::fuzz

#pragma once

#include <cstddef>
#include <memory>
#include <string>

struct gzFile_s;

namespace xray_registration {

/// A plain or gzip-compressed file, whatever its name says, read from its start.
class ByteStream {
 public:
  /// @throws VolumeError when the file cannot be opened.
  explicit ByteStream(const std::string& path);

  /// Reads exactly `count` bytes.
  /// @throws VolumeError when the file ends before, or its compressed data are damaged.
  void read(char* out, std::size_t count);

  /// As many bytes as there are, up to `count`.
  std::size_t readSome(char* out, std::size_t count);

  void skip(std::size_t count);

  /// Looks at the check sum behind compressed data whose last byte was read.
  /// @throws VolumeError when it does not fit.
  void finish();

  /// Whether so many bytes, from the start, can come out of a file of its size.
  /// @throws VolumeError when they cannot.
  void checkClaim(double bytes) const;

 private:
  struct Close {
    void operator()(gzFile_s* file) const;
  };

  [[noreturn]] void refuseDamaged() const;

  std::string path_;
  std::unique_ptr<gzFile_s, Close> file_;
};

/// @throws VolumeError when `bytes` cannot come out of deflated data in a file of the path's size.
void checkDeflateClaim(const std::string& path, const std::string& data_file, double bytes);

/// Unpacks a zlib or gzip stream that begins at `offset` of a file and must hold `bytes` bytes.
/// @throws VolumeError when it holds fewer or is damaged.
void inflatePart(const std::string& path, const std::string& data_file, std::size_t offset, std::size_t bytes,
                 char* out);

}  // namespace xray_registration

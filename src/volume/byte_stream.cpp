#include "byte_stream.h"

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
// What deflate can make of one byte at most (zlib's documentation: 1032 : 1).
constexpr double kLargestDeflateRatio = 1032.0;
constexpr int kZlibOrGzip = 15 + 32;  // inflateInit2: the largest window, header found by itself.

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

[[noreturn]] void refuseTruncated(const std::string& path) {
  refuse(path, "the file is truncated or damaged: it ends before its last voxel");
}

double sizeOf(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? std::numeric_limits<double>::infinity() : static_cast<double>(size);
}

struct EndInflate {
  void operator()(z_stream* stream) const { inflateEnd(stream); }
};

}  // namespace

void ByteStream::Close::operator()(gzFile_s* file) const { gzclose(file); }

ByteStream::ByteStream(const std::string& path) : path_(path), file_(gzopen(path.c_str(), "rb")) {
  if (!file_) refuse(path, "the file cannot be opened");
  gzbuffer(file_.get(), kChunkBytes / 4);
}

std::size_t ByteStream::readSome(char* out, std::size_t count) {
  std::size_t all = 0;
  while (count > 0) {
    const int got = gzread(file_.get(), out, static_cast<unsigned>(std::min(count, kChunkBytes)));
    if (got < 0) refuseDamaged();
    if (got == 0) break;
    out += got;
    all += static_cast<std::size_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return all;
}

void ByteStream::read(char* out, std::size_t count) {
  if (readSome(out, count) != count) refuseTruncated(path_);
}

void ByteStream::skip(std::size_t count) {
  std::vector<char> unused(std::min(count, kChunkBytes));
  while (count > 0) {
    const std::size_t part = std::min(count, kChunkBytes);
    read(unused.data(), part);
    count -= part;
  }
}

void ByteStream::finish() {
  char more = 0;
  if (gzread(file_.get(), &more, 1) < 0) refuseDamaged();
}

void ByteStream::refuseDamaged() const {
  int code = Z_OK;
  gzerror(file_.get(), &code);
  if (code == Z_DATA_ERROR) refuse(path_, "the file is damaged: its compressed data do not fit their check sum");
  refuseTruncated(path_);
}

void ByteStream::checkClaim(double bytes) const {
  const double size = sizeOf(path_);
  if (gzdirect(file_.get()) != 0) {
    if (size < bytes) refuseTruncated(path_);
  } else {
    checkDeflateClaim(path_, path_, bytes);
  }
}

void checkDeflateClaim(const std::string& path, const std::string& data_file, double bytes) {
  const double size = sizeOf(data_file);
  if (bytes <= kLargestDeflateRatio * size) return;
  std::ostringstream text;
  text << "its header claims " << bytes / 1e6 << " MB of voxels, which cannot lie in the " << size / 1e6
       << " MB of its file: the file is truncated or damaged";
  refuse(path, text.str());
}

void inflatePart(const std::string& path, const std::string& data_file, std::size_t offset, std::size_t bytes,
                 char* out) {
  std::ifstream file(data_file, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(offset));
  z_stream stream{};
  if (inflateInit2(&stream, kZlibOrGzip) != Z_OK) throw VolumeError("'" + path + "': zlib cannot be used");
  const std::unique_ptr<z_stream, EndInflate> end(&stream);
  std::vector<char> in(kChunkBytes);
  std::size_t done = 0;
  int state = Z_OK;
  while (done < bytes && state == Z_OK) {
    if (stream.avail_in == 0) {
      file.read(in.data(), static_cast<std::streamsize>(in.size()));
      stream.next_in = reinterpret_cast<Bytef*>(in.data());
      stream.avail_in = static_cast<uInt>(file.gcount());
      if (stream.avail_in == 0) break;
    }
    const std::size_t part = std::min(bytes - done, std::size_t{std::numeric_limits<uInt>::max()});
    stream.next_out = reinterpret_cast<Bytef*>(out + done);
    stream.avail_out = static_cast<uInt>(part);
    state = inflate(&stream, Z_NO_FLUSH);
    done += part - stream.avail_out;
  }
  if (done < bytes) refuseTruncated(path);
}

}  // namespace xray_registration

#include "file_integrity.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <vector>

#include "header_text.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNiftiHeaderBytes = 348;
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
constexpr std::int16_t kNiftiFloat = 16;
constexpr std::int16_t kNiftiDouble = 64;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

struct CloseGz {
  void operator()(gzFile_s* file) const { gzclose(file); }
};

// A plain or gzipped file, read from its start.
class ByteStream {
 public:
  explicit ByteStream(const std::string& path) : path_(path), file_(gzopen(path.c_str(), "rb")) {
    if (!file_) refuse(path, "the file cannot be opened");
    gzbuffer(file_.get(), kChunkBytes / 4);
  }

  // Reads exactly `count` bytes.
  void read(char* out, std::size_t count) {
    while (count > 0) {
      const int got = gzread(file_.get(), out, static_cast<unsigned>(std::min(count, kChunkBytes)));
      if (got <= 0) refuse(path_, "the file is truncated or damaged: it ends before its last voxel");
      out += got;
      count -= static_cast<std::size_t>(got);
    }
  }

  void skip(std::size_t count) {
    std::vector<char> unused(std::min(count, kChunkBytes));
    for (; count > 0; count -= std::min(count, kChunkBytes)) read(unused.data(), std::min(count, kChunkBytes));
  }

 private:
  std::string path_;
  std::unique_ptr<gzFile_s, CloseGz> file_;
};

template <typename T>
T valueAt(const char* bytes, bool swap) {
  std::array<char, sizeof(T)> own{};
  std::copy(bytes, bytes + sizeof(T), own.begin());
  if (swap) std::reverse(own.begin(), own.end());
  T value;
  std::memcpy(&value, own.data(), sizeof(T));
  return value;
}

struct NiftiHeader {
  bool swap = false;
  bool detached = false;
  std::size_t voxels = 1;
  std::size_t bytes_per_voxel = 0;
  std::size_t data_offset = 0;
  std::int16_t datatype = 0;
};

NiftiHeader parsedHeader(const std::vector<char>& bytes, const std::string& path) {
  NiftiHeader header;
  header.swap = valueAt<std::int32_t>(bytes.data(), false) != static_cast<std::int32_t>(kNiftiHeaderBytes);
  const std::string magic(&bytes[344], 3);
  if (magic != "n+1" && magic != "ni1") {
    refuse(path, "it is no NIfTI-1 file; an Analyze file does not state its frame and is not read");
  }
  header.detached = magic == "ni1";
  const int dimensions = std::clamp<int>(valueAt<std::int16_t>(&bytes[40], header.swap), 0, 7);
  for (int i = 0; i < dimensions; ++i) {
    const auto size = valueAt<std::int16_t>(&bytes[static_cast<std::size_t>(42 + 2 * i)], header.swap);
    header.voxels *= static_cast<std::size_t>(std::max<int>(size, 1));
  }
  header.datatype = valueAt<std::int16_t>(&bytes[70], header.swap);
  header.bytes_per_voxel = static_cast<std::size_t>(valueAt<std::int16_t>(&bytes[72], header.swap)) / 8;
  const float offset = valueAt<float>(&bytes[108], header.swap);
  header.data_offset = offset > 0.0F && offset < 1e9F ? static_cast<std::size_t>(offset) : 0;
  if (!header.detached) header.data_offset = std::max<std::size_t>(header.data_offset, kNiftiHeaderBytes + 4);
  return header;
}

// The file beside a detached header that holds the voxels.
std::string detachedData(const std::string& path) {
  fs::path data = path;
  if (data.extension() == ".gz") data.replace_extension();
  data.replace_extension(".img");
  if (!fs::exists(data)) data += ".gz";
  return data.string();
}

template <typename T>
void reportNotFinite(const std::vector<char>& bytes, std::size_t count, std::size_t first, bool swap,
                     const std::function<void(std::size_t, double)>& not_finite) {
  for (std::size_t i = 0; i < count; ++i) {
    const T value = valueAt<T>(&bytes[i * sizeof(T)], swap);
    if (!std::isfinite(value)) not_finite(first + i, static_cast<double>(value));
  }
}

}  // namespace

void scanNifti(const std::string& path, const std::function<void(std::size_t, double)>& not_finite) {
  std::vector<char> bytes(kNiftiHeaderBytes);
  auto stream = std::make_unique<ByteStream>(path);
  stream->read(bytes.data(), bytes.size());
  const NiftiHeader header = parsedHeader(bytes, path);
  if (header.detached) {
    stream = std::make_unique<ByteStream>(detachedData(path));
    stream->skip(header.data_offset);
  } else {
    stream->skip(header.data_offset - kNiftiHeaderBytes);
  }
  bytes.resize(kChunkBytes);
  const std::size_t chunk = kChunkBytes / std::max<std::size_t>(header.bytes_per_voxel, 1);
  for (std::size_t first = 0; first < header.voxels; first += chunk) {
    const std::size_t count = std::min(chunk, header.voxels - first);
    stream->read(bytes.data(), count * header.bytes_per_voxel);
    if (header.datatype == kNiftiFloat && header.bytes_per_voxel == sizeof(float)) {
      reportNotFinite<float>(bytes, count, first, header.swap, not_finite);
    } else if (header.datatype == kNiftiDouble && header.bytes_per_voxel == sizeof(double)) {
      reportNotFinite<double>(bytes, count, first, header.swap, not_finite);
    }
  }
}

void checkMetaImage(const std::string& path, std::size_t bytes) {
  const HeaderField data = headerField(path, {"elementdatafile"});
  std::string file = path;
  std::size_t before = data.end_of_line;
  if (lowerCase(data.value) != "local") {
    if (lowerCase(data.value).rfind("list", 0) == 0 || data.value.find('%') != std::string::npos) {
      refuse(path, "its voxels lie in several files; write it as one .mha");
    }
    file = (fs::path(path).parent_path() / data.value).string();
    before = 0;
  }
  if (lowerCase(headerField(path, {"compresseddata"}).value) == "true") {
    bytes =
        static_cast<std::size_t>(std::strtoull(headerField(path, {"compresseddatasize"}).value.c_str(), nullptr, 10));
  }
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) refuse(path, "the file of its voxels, '" + data.value + "', cannot be opened: " + error.message());
  if (size < before + bytes) refuse(path, "the file is truncated or damaged: it ends before its last voxel");
}

}  // namespace xray_registration

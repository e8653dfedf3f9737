#include "nifti_file.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <type_traits>

#include "byte_stream.h"
#include "file_boundary.h"
#include "header_text.h"
#include "nifti_header.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

// The file beside a detached header that holds the voxels, or the other way round.
std::string besideWith(const std::string& extension, const std::string& path) {
  fs::path other = path;
  if (lowerCase(other.extension().string()) == ".gz") other.replace_extension();
  other.replace_extension(extension);
  if (!fs::exists(other) && fs::exists(other.string() + ".gz")) other += ".gz";
  return other.string();
}

// Where the header of a CT lies that was named by its voxels' file.
std::string headerFile(const std::string& path) {
  fs::path name = path;
  if (lowerCase(name.extension().string()) == ".gz") name.replace_extension();
  return lowerCase(name.extension().string()) == ".img" ? besideWith(".hdr", path) : path;
}

void swapBytes(std::size_t bytes_per_voxel, std::vector<char>* bytes) {
  if (bytes_per_voxel < 2) return;
  for (auto voxel = bytes->begin(); bytes->end() - voxel >= static_cast<std::ptrdiff_t>(bytes_per_voxel);
       voxel += static_cast<std::ptrdiff_t>(bytes_per_voxel)) {
    std::reverse(voxel, voxel + static_cast<std::ptrdiff_t>(bytes_per_voxel));
  }
}

// Turns a chunk of stored numbers into HU or labels.
template <typename From, typename To>
void convertChunk(const std::vector<char>& bytes, std::size_t count, const NiftiHeader& header, const FileRule& rule,
                  To* out, ValueFacts* facts) {
  convertValues(reinterpret_cast<const From*>(bytes.data()), count, header.scale, rule, out, facts);
}

template <typename To>
using Converter = void (*)(const std::vector<char>&, std::size_t, const NiftiHeader&, const FileRule&, To*,
                           ValueFacts*);

struct NiftiType {
  std::int32_t datatype;
  const char* name;
};

template <typename To>
Converter<To> converterFor(std::int32_t datatype) {
  switch (datatype) {
    case 2:
      return convertChunk<std::uint8_t, To>;
    case 4:
      return convertChunk<std::int16_t, To>;
    case 8:
      return convertChunk<std::int32_t, To>;
    case 16:
      return convertChunk<float, To>;
    case 64:
      return convertChunk<double, To>;
    case 256:
      return convertChunk<std::int8_t, To>;
    case 512:
      return convertChunk<std::uint16_t, To>;
    case 768:
      return convertChunk<std::uint32_t, To>;
    case 1024:
      return convertChunk<std::int64_t, To>;
    default:  // 1280; the header was checked.
      return convertChunk<std::uint64_t, To>;
  }
}

const char* nameOf(std::int32_t datatype) {
  constexpr NiftiType kTypes[] = {{2, "uint8"},  {4, "int16"},    {8, "int32"},    {16, "float32"}, {64, "float64"},
                                  {256, "int8"}, {512, "uint16"}, {768, "uint32"}, {1024, "int64"}, {1280, "uint64"}};
  for (const NiftiType& type : kTypes) {
    if (type.datatype == datatype) return type.name;
  }
  return "";
}

// The header, and a stream that stands at the first voxel.
struct OpenNifti {
  NiftiHeader header;
  std::unique_ptr<ByteStream> stream;
};

OpenNifti opened(const std::string& path, const FileRule& rule) {
  const std::string header_path = headerFile(path);
  checkReferred(path, header_path, rule.directory);
  auto stream = std::make_unique<ByteStream>(header_path);
  std::vector<char> bytes(kNiftiHeaderBytes);
  stream->read(bytes.data(), bytes.size());
  bytes.resize(niftiHeaderBytes(bytes));
  if (bytes.empty()) throw VolumeError("'" + path + "': it is no NIfTI file, or it is damaged");
  if (bytes.size() > kNiftiHeaderBytes) {
    stream->read(bytes.data() + kNiftiHeaderBytes, bytes.size() - kNiftiHeaderBytes);
  }
  OpenNifti file{parsedNiftiHeader(bytes, rule, path), nullptr};
  std::size_t before = file.header.data_offset;
  if (file.header.detached) {
    const std::string voxels_path = besideWith(".img", header_path);
    checkReferred(path, voxels_path, rule.directory);
    stream = std::make_unique<ByteStream>(voxels_path);
  } else {
    before -= bytes.size();
  }
  const double voxels = static_cast<double>(file.header.grid.voxelCount());
  stream->checkClaim(static_cast<double>(file.header.data_offset) +
                     voxels * static_cast<double>(file.header.bytes_per_voxel));
  stream->skip(before);
  file.stream = std::move(stream);
  return file;
}

template <typename To>
constexpr std::int32_t niftiTypeOf() {
  return std::is_same<To, std::int16_t>::value ? 4 : 512;
}

template <typename To>
void readVoxels(OpenNifti* file, const FileRule& rule, FileImage<To>* image) {
  const NiftiHeader& header = file->header;
  const std::size_t size = header.bytes_per_voxel;
  if (header.datatype == niftiTypeOf<To>() && !header.swap && changesNothing(header.scale, rule)) {
    file->stream->read(reinterpret_cast<char*>(image->voxels.data()), image->voxels.size() * size);
    return noteValues(image->voxels.data(), image->voxels.size(), &image->facts);
  }
  const Converter<To> convert = converterFor<To>(header.datatype);
  std::vector<char> bytes(kChunkBytes);
  const std::size_t chunk = kChunkBytes / size;
  for (std::size_t first = 0; first < image->voxels.size(); first += chunk) {
    const std::size_t count = std::min(chunk, image->voxels.size() - first);
    file->stream->read(bytes.data(), count * size);
    if (header.swap) swapBytes(size, &bytes);
    convert(bytes, count, header, rule, image->voxels.data() + first, &image->facts);
  }
}

template <typename To>
FileImage<To> readNifti(const std::string& path, const FileRule& rule) {
  OpenNifti file = opened(path, rule);
  FileImage<To> image;
  image.grid = file.header.grid;
  image.format = "NIfTI-" + std::to_string(file.header.version) + ", " + nameOf(file.header.datatype) +
                 ", orientation from " + file.header.orientation;
  image.warnings = std::move(file.header.warnings);
  try {
    image.voxels.resize(image.grid.voxelCount());
  } catch (const std::bad_alloc&) {
    throw VolumeError("'" + path + "': it cannot be read: not enough memory for the size that its header states");
  }
  readVoxels(&file, rule, &image);
  file.stream->finish();
  return image;
}

}  // namespace

bool isNifti(const std::string& path) {
  ByteStream stream(headerFile(path));
  std::vector<char> bytes(kNiftiHeaderBytes);
  bytes.resize(stream.readSome(bytes.data(), bytes.size()));
  return niftiHeaderBytes(bytes) > 0;
}

FileImage<std::int16_t> readNiftiHu(const std::string& path, const FileRule& rule) {
  return readNifti<std::int16_t>(path, rule);
}

FileImage<std::uint16_t> readNiftiLabels(const std::string& path, const FileRule& rule) {
  return readNifti<std::uint16_t>(path, rule);
}

}  // namespace xray_registration

#include "meta_image.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <locale>
#include <sstream>

#include "byte_stream.h"
#include "header_text.h"
#include "xray_registration/common/log.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

// As ITK understands them.
bool isTrue(const std::string& value) {
  return !value.empty() && (value[0] == 'T' || value[0] == 't' || value[0] == '1');
}

bool states(const std::string& path, const std::vector<std::string>& keys) {
  return !headerField(path, keys).value.empty();
}

// ITK only says that it cannot read such a file.
void checkNumbers(const std::string& path, const std::vector<std::string>& keys, const std::string& name) {
  std::istringstream words(headerField(path, keys).value);
  for (std::string word; words >> word;) {
    std::istringstream number(word);
    number.imbue(std::locale::classic());
    double value = 0.0;
    if (!(number >> value) || !std::isfinite(value)) {
      refuse(path, "it states '" + onOneLine(word) + "' as " + name + ", which is no number: write it anew");
    }
  }
}

void checkSpacing(const std::string& path) {
  for (const char* key : {"elementspacing", "elementsize"}) checkNumbers(path, {key}, "its voxel size");
  std::istringstream numbers(headerField(path, {"elementspacing"}).value);
  numbers.imbue(std::locale::classic());
  for (double spacing = 0.0; numbers >> spacing;) {
    if (!(spacing > 0.0)) {
      refuse(path, "it states a voxel size that is not positive (ElementSpacing): write it anew with the right one");
    }
  }
}

}  // namespace

void checkMetaImageDimensions(const std::string& path) {
  constexpr std::size_t kLongestHeader = std::size_t{1} << 20;
  const std::string key = "NDims";
  std::string text(kLongestHeader, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  text.resize(std::min(text.find("ElementDataFile"), text.size()));
  // The library takes words as they come, across lines and more than once.
  for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
    const std::size_t value = std::min(text.find_first_not_of(" \t\r\n=:", at + key.size()), text.size());
    const long dimensions = std::strtol(text.c_str() + value, nullptr, 10);
    if (dimensions < 1 || dimensions > 10) refuse(path, "its header states an impossible number of dimensions (NDims)");
  }
}

MetaImageData metaImageData(const std::string& path, std::size_t bytes) {
  const HeaderField named = headerField(path, {"elementdatafile"});
  MetaImageData data{path, named.end_of_line, false, false};
  if (lowerCase(named.value) != "local") {
    if (lowerCase(named.value).rfind("list", 0) == 0 || named.value.find('%') != std::string::npos) {
      refuse(path, "its voxels lie in several files; write it as one .mha");
    }
    data.file = (fs::path(path).parent_path() / named.value).string();
    data.offset = 0;
  }
  data.is_compressed = isTrue(headerField(path, {"compresseddata"}).value);
  data.is_big_endian = isTrue(headerField(path, {"binarydatabyteordermsb", "elementbyteordermsb"}).value);
  std::error_code error;
  const auto size = static_cast<std::size_t>(fs::file_size(data.file, error));
  if (error) refuse(path, "the file of its voxels, '" + named.value + "', cannot be opened: " + error.message());
  std::size_t stored = bytes;
  if (data.is_compressed) {
    // Without its size the compressed data go to the end of the file.
    stored =
        static_cast<std::size_t>(std::strtoull(headerField(path, {"compresseddatasize"}).value.c_str(), nullptr, 10));
    checkDeflateClaim(path, data.file, static_cast<double>(bytes));
  }
  const std::string binary = headerField(path, {"binarydata"}).value;
  // As text a voxel takes a digit and a blank at least, and up to eight bytes in memory.
  if (!binary.empty() && !isTrue(binary)) stored = bytes / 4;
  // -1: the voxels are the last of the file.
  const long long header_size = std::strtoll(headerField(path, {"headersize"}).value.c_str(), nullptr, 10);
  if (header_size > 0) data.offset = static_cast<std::size_t>(header_size);
  if (header_size == -1 && size >= stored) data.offset = size - stored;
  if (size < stored || size - stored < data.offset) {
    refuse(path, "the file is truncated or damaged: it ends before its last voxel");
  }
  return data;
}

MetaImageText metaImageText(const std::string& path) {
  checkSpacing(path);
  checkNumbers(path, {"transformmatrix", "orientation", "rotation"}, "a direction of its axes");
  checkNumbers(path, {"offset", "position", "origin"}, "its origin");
  MetaImageText text;
  text.has_orientation = states(path, {"transformmatrix", "orientation", "rotation"});
  if (!states(path, {"elementspacing", "elementsize"})) {
    text.warnings.push_back("it states no voxel size; 1 mm is taken");
  }
  const std::string unit = lowerCase(headerField(path, {"distanceunits"}).value);
  if (unit == "um") text.unit_mm = 0.001;
  if (unit == "cm") text.unit_mm = 10.0;
  return text;
}

}  // namespace xray_registration

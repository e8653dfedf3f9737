#include "bag_structure.h"

#include <bzlib.h>
#include <roslz4/lz4s.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <vector>

namespace xray_registration {
namespace {

constexpr char kMagic[] = "#ROSBAG V2.0\n";
// A chunk is closed by the message that fills it, and roscpp sends none of more than 10⁹ bytes.
constexpr std::uint32_t kLargestChunk = 0x80000000;
// What LZ4 unpacks from one byte at most.
constexpr double kLargestLz4Ratio = 255.0;
constexpr std::size_t kUnpackStep = 1U << 20U;

enum Operation : std::uint8_t {
  kMessage = 2,
  kFileHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7
};

// What is wrong.
struct Damage {
  std::string what;
};

template <typename T>
T numberAt(const char* place) {
  T value;
  std::memcpy(&value, place, sizeof value);
  return value;
}

class Fields {
 public:
  // "<length><name>=<value>", one after the other.
  Fields(const char* data, std::size_t size) {
    for (std::size_t place = 0; place < size;) {
      if (size - place < 4) throw Damage{"a record's header is cut off"};
      const auto length = numberAt<std::uint32_t>(data + place);
      place += 4;
      if (length > size - place) throw Damage{"a field is longer than its record"};
      const std::string field(data + place, length);
      place += length;
      const std::size_t equals = field.find('=');
      if (equals == std::string::npos) throw Damage{"a field has no value"};
      values_[field.substr(0, equals)] = field.substr(equals + 1);
    }
  }

  template <typename T>
  T number(const char* name) const {
    const std::string value = text(name);
    if (value.size() != sizeof(T)) throw Damage{std::string("the field '") + name + "' has the wrong length"};
    return numberAt<T>(value.data());
  }

  std::string text(const char* name) const {
    const auto found = values_.find(name);
    return found == values_.end() ? std::string() : found->second;
  }

 private:
  std::map<std::string, std::string> values_;
};

std::vector<char> unpackedBz2(std::vector<char>* packed, std::uint32_t size) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw Damage{"a chunk cannot be unpacked"};
  stream.next_in = packed->data();
  stream.avail_in = static_cast<unsigned>(packed->size());
  std::vector<char> unpacked;
  int result = BZ_OK;
  // In steps, so that memory is taken for what is there and not for what is claimed.
  while (result == BZ_OK && unpacked.size() <= size) {
    const std::size_t before = unpacked.size();
    unpacked.resize(before + kUnpackStep);
    stream.next_out = unpacked.data() + before;
    stream.avail_out = kUnpackStep;
    result = BZ2_bzDecompress(&stream);
    unpacked.resize(unpacked.size() - stream.avail_out);
    if (unpacked.size() == before && stream.avail_in == 0) break;
  }
  BZ2_bzDecompressEnd(&stream);
  if (result != BZ_STREAM_END) throw Damage{"a chunk cannot be unpacked"};
  return unpacked;
}

std::vector<char> unpackedLz4(std::vector<char>* packed, std::uint32_t size) {
  if (size > kLargestLz4Ratio * static_cast<double>(packed->size())) {
    throw Damage{"a chunk claims more than it can hold"};
  }
  std::vector<char> unpacked(size);
  unsigned unpacked_size = size;
  const int result = roslz4_buffToBuffDecompress(packed->data(), static_cast<unsigned>(packed->size()), unpacked.data(),
                                                 &unpacked_size);
  if (result != ROSLZ4_OK) throw Damage{"a chunk cannot be unpacked"};
  unpacked.resize(unpacked_size);
  return unpacked;
}

// Where the messages of a chunk begin.
std::set<std::uint32_t> messagesOf(const std::vector<char>& chunk) {
  std::set<std::uint32_t> places;
  const auto lengthAt = [&chunk](std::size_t place) {
    if (chunk.size() - place < 4) throw Damage{"a chunk ends within a record"};
    const auto length = numberAt<std::uint32_t>(chunk.data() + place);
    if (length > chunk.size() - place - 4) throw Damage{"a record is longer than its chunk"};
    return length;
  };
  for (std::size_t place = 0; place < chunk.size();) {
    const std::size_t start = place;
    const std::uint32_t header = lengthAt(place);
    const auto operation = Fields(chunk.data() + place + 4, header).number<std::uint8_t>("op");
    place += 4 + header;
    place += 4 + lengthAt(place);
    if (operation == kMessage) places.insert(static_cast<std::uint32_t>(start));
  }
  return places;
}

class Walk {
 public:
  explicit Walk(const std::string& path) : stream_(path, std::ios::binary) {
    stream_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(std::max<std::streamoff>(stream_.tellg(), 0));
    stream_.seekg(0);
  }

  void check() {
    if (!beginsAsBag()) return;
    const Record first = record();
    if (first.operation != kFileHeader) throw Damage{"its first record is not a bag's"};
    if (!first.fields.text("encryptor").empty()) throw Damage{"it is encrypted, which is not read"};
    const auto index = first.fields.number<std::uint64_t>("index_pos");
    if (index == 0) return;  // Not closed: rosbag says so.
    lookAt(first);
    while (position_ < size_) lookAt(record());
    checkPlaces(index, first.fields.number<std::uint32_t>("chunk_count"));
  }

  std::uint64_t position() const { return position_; }

 private:
  std::vector<char> bytes(std::size_t count) {
    if (count > size_ - position_) throw Damage{"a record ends behind the end of the file"};
    std::vector<char> data(count);
    if (!stream_.read(data.data(), static_cast<std::streamsize>(count))) throw Damage{"it cannot be read"};
    position_ += count;
    return data;
  }

  // rosbag knows older versions too, whose records are others.
  bool beginsAsBag() {
    constexpr std::size_t mark = 4;  // "#ROS".
    constexpr std::size_t length = sizeof kMagic - 1;
    if (size_ < length) return false;
    const std::vector<char> start = bytes(length);
    if (!std::equal(start.begin(), start.begin() + mark, kMagic)) return false;
    if (!std::equal(start.begin(), start.end(), kMagic)) throw Damage{"it is no bag of version 2.0"};
    return true;
  }

  struct Record {
    Fields fields;
    std::uint8_t operation = 0;
  };

  // Up to its data.
  Record record() {
    const std::uint64_t start = position_;
    const std::vector<char> header = bytes(length());
    Fields fields(header.data(), header.size());
    const auto operation = fields.number<std::uint8_t>("op");
    starts_[start] = operation;
    return {std::move(fields), operation};
  }

  std::uint32_t length() { return numberAt<std::uint32_t>(bytes(4).data()); }

  void lookAt(const Record& record) {
    const auto& [fields, operation] = record;
    std::vector<char> data = bytes(length());
    if (operation == kChunk) {
      lookAtChunk(fields, &data);
    } else if (operation == kIndex) {
      lookAtIndex(fields, data);
    } else if (operation == kConnection) {
      Fields(data.data(), data.size());
    } else if (operation == kChunkInfo) {
      if (fields.number<std::uint32_t>("count") != data.size() / 8 || data.size() % 8 != 0) {
        throw Damage{"a chunk's list of connections has another length than it says"};
      }
      chunk_places_.insert(fields.number<std::uint64_t>("chunk_pos"));
    }
  }

  void lookAtChunk(const Fields& fields, std::vector<char>* data) {
    const auto size = fields.number<std::uint32_t>("size");
    const std::string compression = fields.text("compression");
    if (size > kLargestChunk) throw Damage{"a chunk claims more than 2 GiB"};
    if (compression == "bz2") {
      *data = unpackedBz2(data, size);
    } else if (compression == "lz4") {
      *data = unpackedLz4(data, size);
    } else if (compression != "none") {
      throw Damage{"a chunk is packed in a way that is not known"};
    }
    if (data->size() != size) throw Damage{"a chunk has another size than it says"};
    messages_ = messagesOf(*data);
  }

  // Of the chunk before it.
  void lookAtIndex(const Fields& fields, const std::vector<char>& data) {
    constexpr std::size_t entry = 12;  // Seconds, nanoseconds, and the message's place in the chunk.
    if (fields.number<std::uint32_t>("count") != data.size() / entry || data.size() % entry != 0) {
      throw Damage{"an index has another length than it says"};
    }
    for (std::size_t i = 0; i < data.size(); i += entry) {
      if (messages_.count(numberAt<std::uint32_t>(data.data() + i + 8)) == 0) {
        throw Damage{"an index points to where no message is"};
      }
    }
  }

  void checkPlaces(std::uint64_t index, std::uint32_t chunk_count) const {
    if (chunk_places_.size() != chunk_count) throw Damage{"its index does not have all chunks"};
    if (starts_.count(index) == 0) throw Damage{"its index is not where it says"};
    for (const std::uint64_t place : chunk_places_) {
      const auto found = starts_.find(place);
      if (found == starts_.end() || found->second != kChunk) throw Damage{"its index points to where no chunk is"};
    }
  }

  std::ifstream stream_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  std::map<std::uint64_t, std::uint8_t> starts_;  // Records, and what they are.
  std::set<std::uint32_t> messages_;              // Of the last chunk.
  std::set<std::uint64_t> chunk_places_;
};

}  // namespace

std::optional<std::string> bagDamage(const std::string& path) {
  Walk walk(path);
  try {
    walk.check();
  } catch (const Damage& damage) {
    return "is damaged before byte " + std::to_string(walk.position()) + ": " + damage.what;
  }
  return std::nullopt;
}

}  // namespace xray_registration

#include "xray_registration/common/dicom_structure.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <string>

// The encoding: DICOM PS3.5, chapter 7, and PS3.10, chapter 7, for the beginning of a file.

namespace xray_registration {
namespace {

constexpr std::uint32_t kUndefined = 0xffffffff;
constexpr std::uint32_t kItem = 0xfffee000;
constexpr std::uint32_t kItemEnd = 0xfffee00d;
constexpr std::uint32_t kSequenceEnd = 0xfffee0dd;
constexpr std::uint32_t kPixels = 0x7fe00010;
constexpr std::uint32_t kBitsAllocated = 0x00280100;
constexpr char kDeflated[] = "1.2.840.10008.1.2.1.99";
constexpr int kDeepest = 32;
constexpr long kPreamble = 128;
constexpr long kNearby = 4096;  // Skipped by reading, which keeps the stream's buffer.

// Those whose length has 16 bits.
bool isShortVr(const std::string& vr) {
  for (const char* known : {"AE", "AS", "AT", "CS", "DA", "DS", "DT", "FD", "FL", "IS", "LO",
                            "LT", "PN", "SH", "SL", "SS", "ST", "TM", "UI", "UL", "US"}) {
    if (vr == known) return true;
  }
  return false;
}

// An element does not fit.
struct Broken {};

struct KnownElement {
  std::uint32_t tag;
  const char* vr;
};

// What GDCM takes to have the VR of the standard (PS3.6) without a look, and ends the process where it has not.
constexpr std::array<KnownElement, 25> kKnown = {
    {{0x00080008, "CS"}, {0x00080016, "UI"}, {0x00080060, "CS"}, {0x00180050, "DS"}, {0x00180088, "DS"},
     {0x00181164, "DS"}, {0x00200032, "DS"}, {0x00200037, "DS"}, {0x00280002, "US"}, {0x00280004, "CS"},
     {0x00280006, "US"}, {0x00280008, "IS"}, {0x00280010, "US"}, {0x00280011, "US"}, {0x00280030, "DS"},
     {0x00280034, "IS"}, {0x00280100, "US"}, {0x00280101, "US"}, {0x00280102, "US"}, {0x00280103, "US"},
     {0x00281050, "DS"}, {0x00281051, "DS"}, {0x00281052, "DS"}, {0x00281053, "DS"}, {0x00281054, "LO"}}};

struct Encoding {
  bool explicit_vr = true;
  bool big_endian = false;
};

struct Element {
  std::uint32_t tag = 0;
  std::string vr;
  std::uint32_t length = 0;
};

void checkKnown(const Element& element) {
  for (const KnownElement& known : kKnown) {
    if (element.tag != known.tag) continue;
    const bool is_short = std::string(known.vr) == "US";
    if (!element.vr.empty() && element.vr != "UN" && element.vr != known.vr) throw Broken();
    if (is_short && element.length != 0 && element.length != sizeof(std::uint16_t)) throw Broken();
  }
}

struct Range {
  std::uint32_t tag;
  std::uint32_t low;
  std::uint32_t high;
};

// Numbers of 16 bits about pixels that GDCM asserts instead of checking: samples, bits allocated and stored, the
// highest.
constexpr std::array<Range, 4> kRanges = {
    {{0x00280002, 1, 4}, {kBitsAllocated, 8, 64}, {0x00280101, 1, 64}, {0x00280102, 0, 63}}};

bool isRanged(std::uint32_t tag) {
  return std::any_of(kRanges.begin(), kRanges.end(), [tag](const Range& range) { return range.tag == tag; });
}

void checkRange(std::uint32_t tag, std::uint32_t value) {
  for (const Range& range : kRanges) {
    if (tag == range.tag && (value < range.low || value > range.high)) throw Broken();
  }
  // Whole bytes; 12 bits in a row were given up in 1998.
  if (tag == kBitsAllocated && value % 8 != 0) throw Broken();
}

// Whose pixels are not packed; nothing: without the part that says.
bool isNative(const std::string& syntax) {
  return syntax.empty() || syntax == "1.2.840.10008.1.2" || syntax == "1.2.840.10008.1.2.1" ||
         syntax == "1.2.840.10008.1.2.2";
}

void dropPadding(std::string* text) {
  while (!text->empty() && (text->back() == '\0' || text->back() == ' ')) text->pop_back();
}

class Walk {
 public:
  explicit Walk(const std::string& path) : stream_(path, std::ios::binary) {
    stream_.seekg(0, std::ios::end);
    size_ = static_cast<long>(stream_.tellg());
    stream_.seekg(0);
  }

  DicomStructure look() {
    DicomStructure found;
    found.is_dicom = beginsAsDicom();
    if (!found.is_dicom) return found;
    try {
      encoding_ = {};
      const std::string syntax = hasMeta() ? walkMeta() : std::string();
      if (position_ >= size_) throw Broken();
      if (syntax == kDeflated) {
        found.is_deflated = true;
        return found;
      }
      encoding_.big_endian = syntax == "1.2.840.10008.1.2.2";
      encoding_.explicit_vr = hasMeta() ? syntax != "1.2.840.10008.1.2" : looksExplicit();
      walkElements(size_, 0);
      found.is_whole = true;
      if (!at_pixels_) header_end_ = size_;
      is_native_ = isNative(syntax);
      found.pixels_fit = !at_pixels_ || pixelsFit();
      if (at_pixels_ && pixels_.length != kUndefined) found.pixel_bytes = pixels_.length;
      found.header_bytes = static_cast<std::uint64_t>(header_end_);
      if (found.pixels_fit) found.image_bytes = static_cast<std::uint64_t>(position_);
    } catch (const Broken&) {
      // What was found out before stands.
    }
    return found;
  }

 private:
  void moveTo(long position) {
    if (position < position_ || position > size_) throw Broken();
    if (position - position_ <= kNearby) {
      stream_.ignore(position - position_);
    } else {
      stream_.seekg(position);
    }
    position_ = position;
  }

  void read(char* out, long count) {
    if (position_ + count > size_ || !stream_.read(out, count)) throw Broken();
    position_ += count;
  }

  std::uint32_t number(int bytes) {
    std::array<unsigned char, 4> raw{};
    read(reinterpret_cast<char*>(raw.data()), bytes);
    std::uint32_t value = 0;
    for (int i = 0; i < bytes; ++i) {
      const int place = encoding_.big_endian ? i : bytes - 1 - i;
      value = value << 8U | raw[static_cast<std::size_t>(place)];
    }
    return value;
  }

  void restartAt(long position) {
    stream_.clear();
    stream_.seekg(position);
    position_ = position;
  }

  bool beginsAsDicom() {
    std::array<char, 4> mark{};
    if (size_ >= kPreamble + 4) {
      stream_.seekg(kPreamble);
      stream_.read(mark.data(), 4);
      restartAt(kPreamble + 4);
      if (std::string(mark.data(), 4) == "DICM") return true;
    }
    // Without the preamble: the first element is of group 2 or 8, little endian.
    restartAt(0);
    std::array<char, 2> group{};
    stream_.read(group.data(), 2);
    const bool is_likely = stream_.good() && (group[0] == 2 || group[0] == 8) && group[1] == 0;
    restartAt(0);
    return is_likely;
  }

  // Looks at two bytes of what comes and goes back.
  std::string peek(long ahead, long count) {
    const long here = position_;
    std::string text(static_cast<std::size_t>(count), '\0');
    moveTo(here + ahead);
    read(text.data(), count);
    restartAt(here);
    return text;
  }

  bool hasMeta() {
    if (!meta_known_) has_meta_ = peek(0, 2) == std::string("\2\0", 2);
    meta_known_ = true;
    return has_meta_;
  }

  bool looksExplicit() {
    const std::string vr = peek(4, 2);
    return std::isupper(static_cast<unsigned char>(vr[0])) != 0 && std::isupper(static_cast<unsigned char>(vr[1])) != 0;
  }

  Element element() {
    Element result;
    const std::uint32_t group = number(2);
    result.tag = group << 16U | number(2);
    // Items and their ends have no VR.
    if (!encoding_.explicit_vr || group == 0xfffe) {
      result.length = number(4);
      return result;
    }
    result.vr.resize(2);
    read(result.vr.data(), 2);
    for (const char* longer : {"OB", "OW", "OF", "OD", "OL", "OV", "SQ", "UC", "UR", "UT", "UN", "SV", "UV"}) {
      if (result.vr != longer) continue;
      number(2);
      result.length = number(4);
      return result;
    }
    if (!isShortVr(result.vr)) throw Broken();
    result.length = number(2);
    return result;
  }

  void skip(std::uint32_t length, long end) {
    if (length == kUndefined || position_ + static_cast<long>(length) > end) throw Broken();
    moveTo(position_ + static_cast<long>(length));
  }

  // Group 2, which is explicit and little endian always. Returns the transfer syntax.
  std::string walkMeta() {
    std::string syntax;
    while (position_ < size_ && peek(0, 2) == std::string("\2\0", 2)) {
      const Element one = element();
      if (one.vr == "SQ") throw Broken();
      if (one.tag == 0x00020010 && one.length < 100 && position_ + static_cast<long>(one.length) <= size_) {
        syntax.resize(one.length);
        read(syntax.data(), static_cast<long>(one.length));
        dropPadding(&syntax);
      } else {
        skip(one.length, size_);
      }
    }
    return syntax;
  }

  // Up to `end`, to the end of an item, or to the pixels of the file itself.
  void walkElements(long end, int depth) {
    if (depth > kDeepest) throw Broken();
    std::uint32_t last_tag = 0;
    while (position_ < end) {
      const long start = position_;
      const Element one = element();
      // GDCM takes the file for one of another encoding, and does not survive what it then reads.
      if (depth == 0 && one.tag <= last_tag) throw Broken();
      // Before an image's pixels there is its size at least.
      if (depth == 0 && one.tag == kPixels && last_tag == 0) throw Broken();
      last_tag = one.tag;
      checkKnown(one);
      if (one.tag == kItemEnd && depth > 0) return;
      if (depth == 0 && one.tag == kPixels) {
        // Of any other VR GDCM takes them for what they are not.
        if (!one.vr.empty() && one.vr != "OB" && one.vr != "OW" && one.vr != "UN") throw Broken();
        header_end_ = start;
        pixels_ = one;
        at_pixels_ = true;
        return;
      }
      if (depth == 0 && isRanged(one.tag) && one.length == sizeof(std::uint16_t)) {
        checkRange(one.tag, number(sizeof(std::uint16_t)));
      } else if (one.length == kUndefined && (one.vr == "OB" || one.vr == "OW")) {
        walkFragments(end);  // Of an icon.
      } else if (one.vr == "SQ" || one.length == kUndefined) {
        if (!one.vr.empty() && one.vr != "SQ" && one.vr != "UN") throw Broken();
        walkSequence(one, end, depth);
      } else {
        skip(one.length, end);
      }
    }
  }

  void walkSequence(const Element& sequence, long end, int depth) {
    const Encoding outer = encoding_;
    // A sequence of unknown VR and length is implicit (PS3.5, 6.2.2).
    if (sequence.vr == "UN") encoding_ = {false, false};
    const bool is_open = sequence.length == kUndefined;
    const long last = is_open ? end : position_ + static_cast<long>(sequence.length);
    if (last > end) throw Broken();
    bool has_end = !is_open;
    while (position_ < last) {
      const Element item = element();
      if (item.tag == kSequenceEnd) {
        if (item.length != 0) throw Broken();
        if (!is_open) continue;  // Not needed, and written by some.
        has_end = true;
        break;
      }
      if (item.tag != kItem) throw Broken();
      const bool item_is_open = item.length == kUndefined;
      const long item_end = item_is_open ? last : position_ + static_cast<long>(item.length);
      if (item_end > last) throw Broken();
      walkElements(item_end, depth + 1);
    }
    if (!has_end) throw Broken();
    encoding_ = outer;
  }

  // Packed pixels: items without elements, up to the sequence's end.
  void walkFragments(long end) {
    for (Element fragment = element(); fragment.tag != kSequenceEnd; fragment = element()) {
      if (fragment.tag != kItem) throw Broken();
      skip(fragment.length, end);
    }
  }

  bool pixelsFit() {
    try {
      if (pixels_.length == kUndefined) {
        // Only packed ones are in fragments; of others GDCM takes what comes for lengths.
        if (is_native_) return false;
        walkFragments(size_);
      } else {
        skip(pixels_.length, size_);
      }
    } catch (const Broken&) {
      return false;
    }
    return true;
  }

  std::ifstream stream_;
  long size_ = 0;
  long position_ = 0;
  Encoding encoding_;
  Element pixels_;
  long header_end_ = 0;
  bool at_pixels_ = false;
  bool is_native_ = false;
  bool meta_known_ = false;
  bool has_meta_ = false;
};

}  // namespace

DicomStructure dicomStructure(const std::string& path) { return Walk(path).look(); }

std::string dicomBeginning(const std::string& path, std::uint64_t bytes) {
  std::string beginning(bytes, '\0');
  std::ifstream(path, std::ios::binary).read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  return beginning;
}

}  // namespace xray_registration

#include "xray_registration/common/escaped.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>

namespace xray_registration {
namespace {

/// A character in UTF-8: how many bytes it has, 0 when it is none.
struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;
};

bool isContinuation(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

// RFC 3629. Longer forms than needed, halves of surrogates and codes beyond the last one are no characters.
Character characterAt(const std::string& text, std::size_t position) {
  const auto first = static_cast<unsigned char>(text[position]);
  if (first < 0x80U) return {first, 1};
  const std::size_t bytes = first >= 0xF0U ? 4 : first >= 0xE0U ? 3 : 2;
  if (first < 0xC2U || first > 0xF4U || position + bytes > text.size()) return {};
  std::uint32_t code = first & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if (!isContinuation(text[position + i])) return {};
    code = code << 6U | (static_cast<unsigned char>(text[position + i]) & 0x3FU);
  }
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kSmallest[bytes] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {};
  return {code, bytes};
}

bool isControl(std::uint32_t code) { return code < 0x20 || (code >= 0x7F && code < 0xA0); }

// Marks that are not seen and change how the rest of the line is: line and paragraph separators, directions of writing.
bool misleads(std::uint32_t code) {
  return code == 0x200E || code == 0x200F || code == 0x061C || (code >= 0x2028 && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069) || code == 0xFEFF;
}

std::string formatted(const char* format, std::uint32_t number) {
  char text[16];
  std::snprintf(text, sizeof text, format, static_cast<unsigned>(number));
  return text;
}

std::string escapedCode(std::uint32_t code) {
  if (code == '\n') return "\\n";
  if (code == '\r') return "\\r";
  if (code == '\t') return "\\t";
  return code < 0x100 ? formatted("\\x%02x", code) : formatted("\\u%04x", code);
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t position = 0; position < text.size();) {
    const Character character = characterAt(text, position);
    if (character.bytes == 0) {
      result += formatted("\\x%02x", static_cast<unsigned char>(text[position]));
      ++position;
      continue;
    }
    if (isControl(character.code) || misleads(character.code)) {
      result += escapedCode(character.code);
    } else {
      result.append(text, position, character.bytes);
    }
    position += character.bytes;
  }
  return result;
}

std::string onOneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return escaped(text);
}

}  // namespace xray_registration

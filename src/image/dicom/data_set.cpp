#include "image/dicom/data_set.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace xray_registration::dicom {
namespace {

constexpr Tag kSharedGroups = 0x52009229;
constexpr Tag kFrameGroups = 0x52009230;

bool hasValue(const Element& element) {
  if (!element.numbers.empty() || !element.bytes.empty() || !element.items.empty()) return true;
  for (const std::string& word : element.words) {
    if (!word.empty()) return true;
  }
  return false;
}

const std::vector<DataSet>* itemsOf(const DataSet& set, Tag tag) {
  const auto found = set.elements.find(tag);
  return found == set.elements.end() ? nullptr : &found->second.items;
}

}  // namespace

Scopes::Scopes(const DataSet& file, std::size_t frame) {
  const auto* own = itemsOf(file, kFrameGroups);
  if (own != nullptr && frame < own->size()) addGroups((*own)[frame]);
  const auto* shared = itemsOf(file, kSharedGroups);
  if (shared != nullptr && !shared->empty()) addGroups(shared->front());
  places_.push_back(&file);
}

void Scopes::addGroups(const DataSet& item) {
  // An item holds one sequence for each macro, and that a single item with the attributes.
  for (const auto& [tag, macro] : item.elements) {
    if (!macro.items.empty()) places_.push_back(&macro.items.front());
  }
}

const Element* Scopes::find(Tag tag) const {
  for (const DataSet* place : places_) {
    const auto found = place->elements.find(tag);
    if (found != place->elements.end() && hasValue(found->second)) return &found->second;
  }
  return nullptr;
}

std::optional<double> Scopes::number(Tag tag) const {
  const Element* element = find(tag);
  if (element == nullptr || element->numbers.empty() || !std::isfinite(element->numbers.front())) return std::nullopt;
  return element->numbers.front();
}

std::vector<double> Scopes::numbers(Tag tag, std::size_t count) const {
  const Element* element = find(tag);
  if (element == nullptr || element->numbers.size() < count) return {};
  const bool are_finite = std::all_of(element->numbers.begin(), element->numbers.end(),
                                      [](double number) { return std::isfinite(number); });
  return are_finite ? element->numbers : std::vector<double>{};
}

std::optional<std::array<double, 2>> Scopes::pair(Tag tag) const {
  const auto values = numbers(tag, 2);
  if (values.empty()) return std::nullopt;
  return std::array<double, 2>{values[0], values[1]};
}

std::string Scopes::word(Tag tag) const {
  const auto all = words(tag);
  return all.empty() ? "" : all.front();
}

std::vector<std::string> Scopes::words(Tag tag) const {
  const Element* element = find(tag);
  return element == nullptr ? std::vector<std::string>{} : element->words;
}

std::string inWords(Tag tag) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "(%04x,%04x)", tag >> 16U, tag & 0xFFFFU);
  return text.data();
}

}  // namespace xray_registration::dicom

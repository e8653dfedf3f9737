#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace xray_registration::dicom {

/// Group in the upper half, element in the lower: 0x00181110 is (0018,1110).
using Tag = std::uint32_t;

struct DataSet;

/// The value of one attribute, in whatever of these forms it has.
struct Element {
  std::vector<std::string> words;  ///< Without the padding; empty ones are kept, since their places count.
  std::vector<double> numbers;     ///< Empty when a word is no number.
  std::string bytes;               ///< Of private attributes that state no type.
  std::vector<DataSet> items;      ///< Of a sequence.
};

/// A file's attributes in memory. Those of group 0010, who the patient is, are not among them.
struct DataSet {
  std::map<Tag, Element> elements;
};

/// Where an attribute of one frame may stand, the nearest place first: the frame's own functional groups, those that
/// all frames share, the file. The data sets must outlive it.
class Scopes {
 public:
  explicit Scopes(const DataSet& file) : places_{&file} {}
  /// Enhanced DICOM: frame number `frame`, from 0.
  Scopes(const DataSet& file, std::size_t frame);

  /// Null when no place has a value.
  const Element* find(Tag tag) const;

  /// Nothing when it is NaN or infinite.
  std::optional<double> number(Tag tag) const;
  /// Empty when there are fewer than `count`, or one is NaN or infinite.
  std::vector<double> numbers(Tag tag, std::size_t count = 1) const;
  /// As DICOM orders them: of rows (vertical), of columns (horizontal).
  std::optional<std::array<double, 2>> pair(Tag tag) const;
  std::string word(Tag tag) const;
  std::vector<std::string> words(Tag tag) const;

 private:
  void addGroups(const DataSet& item);

  std::vector<const DataSet*> places_;
};

/// "(0018,1110)"
std::string inWords(Tag tag);

}  // namespace xray_registration::dicom

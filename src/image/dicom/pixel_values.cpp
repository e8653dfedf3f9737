#include "image/dicom/pixel_values.h"

#include <algorithm>
#include <cmath>

#include "image/dicom/tags.h"

namespace xray_registration::dicom {
namespace {

/// The table that makes values linear: that of enhanced DICOM, else the modality's. Null when there is none.
const DataSet* tableOf(const Scopes& scopes) {
  for (const Tag tag : {tag::kPixelIntensityRelationshipLutSequence, tag::kModalityLutSequence}) {
    const Element* sequence = scopes.find(tag);
    if (sequence != nullptr && !sequence->items.empty()) return &sequence->items.front();
  }
  return nullptr;
}

}  // namespace

PixelValues::PixelValues(const DataSet& file, int bits, bool is_signed) {
  const double largest = std::exp2(is_signed ? bits - 1 : bits) - 1.0;
  const double smallest = is_signed ? -std::exp2(bits - 1) : 0.0;
  full_scale_ = largest;
  const Scopes scopes(file, 0);
  if (const DataSet* table = tableOf(scopes)) {
    const Scopes entries(*table);
    const auto descriptor = entries.numbers(tag::kLutDescriptor, 3);
    table_ = entries.numbers(tag::kLutData);
    if (!table_.empty() && descriptor.size() >= 3) {
      first_ = is_signed && descriptor[1] > 32767.0 ? descriptor[1] - 65536.0 : descriptor[1];
      full_scale_ = *std::max_element(table_.begin(), table_.end());
      return;
    }
    table_.clear();
  }
  slope_ = scopes.number(tag::kRescaleSlope).value_or(1.0);
  intercept_ = scopes.number(tag::kRescaleIntercept).value_or(0.0);
  if (slope_ == 0.0) slope_ = 1.0;
  // From 0 on, whatever the detector counts from: nothing here needs the offset.
  if (is_signed && slope_ == 1.0) intercept_ = -smallest;
  full_scale_ = std::max(slope_ * largest, slope_ * smallest) + intercept_;
  integral_ =
      slope_ == 1.0 && intercept_ == std::floor(intercept_) && smallest + intercept_ >= 0.0 && full_scale_ <= 65535.0;
}

double PixelValues::of(std::int32_t stored) const {
  if (table_.empty()) return slope_ * stored + intercept_;
  const double place = std::clamp(stored - first_, 0.0, static_cast<double>(table_.size() - 1));
  return table_[static_cast<std::size_t>(place)];
}

}  // namespace xray_registration::dicom

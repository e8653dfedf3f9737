#pragma once

#include <cstdint>
#include <vector>

#include "image/dicom/data_set.h"

namespace xray_registration::dicom {

/// Stored values → what they stand for: linearised by the file's table, or rescaled.
class PixelValues {
 public:
  PixelValues() = default;
  PixelValues(const DataSet& file, int bits, bool is_signed);

  double of(std::int32_t stored) const;
  double fullScale() const { return full_scale_; }
  bool isIntegral() const { return integral_; }

 private:
  std::vector<double> table_;
  double first_ = 0.0;  ///< The stored value that the table begins with.
  double slope_ = 1.0;
  double intercept_ = 0.0;
  double full_scale_ = 0.0;
  bool integral_ = true;
};

}  // namespace xray_registration::dicom

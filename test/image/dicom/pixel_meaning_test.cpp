#include <gtest/gtest.h>

#include "xray_registration/image/xray_dicom.h"

namespace xray_registration {
namespace {

struct Case {
  const char* modality;
  const char* photometric;
  const char* relationship;
  std::optional<double> sign;
  bool has_lut;
  bool is_attenuation;
  bool reversed;
  bool assumed;
};

TEST(PixelMeaningTest, WhatTheAttributesSay) {
  const std::vector<Case> cases = {
      // Angiography and fluoroscopy show what absorbs dark.
      {"XA", "MONOCHROME2", "LIN", {}, false, false, false, false},
      {"XA", "MONOCHROME1", "LIN", {}, false, false, true, false},
      {"RF", "MONOCHROME2", "DISP", {}, false, false, false, false},
      {"XA", "MONOCHROME2", "LOG", {}, false, true, true, false},
      {"XA", "MONOCHROME2", "LOG", {}, true, false, false, false},
      {"XA", "MONOCHROME2", "", {}, false, false, false, true},
      // Radiographs show it bright, unless the sign says otherwise.
      {"DX", "MONOCHROME2", "LIN", 1.0, false, false, false, false},
      {"DX", "MONOCHROME2", "LIN", -1.0, false, false, true, false},
      {"DX", "MONOCHROME1", "LOG", 1.0, false, true, true, false},
      {"DX", "MONOCHROME2", "LOG", -1.0, false, true, false, false},
      {"DX", "MONOCHROME2", "DISP", {}, false, false, true, true},
      {"DX", "MONOCHROME1", "DISP", {}, false, false, false, true},
      // Plates are read as logarithms.
      {"CR", "MONOCHROME1", "", {}, false, true, true, true},
      {"CR", "MONOCHROME2", "", {}, false, true, false, true},
  };
  for (const Case& one : cases) {
    DicomHeader header;
    header.modality = one.modality;
    header.photometric = one.photometric;
    header.relationship = one.relationship;
    header.relationship_sign = one.sign;
    header.has_lut = one.has_lut;
    const PixelMeaning meaning = pixelMeaning(header);
    const std::string name = std::string(one.modality) + " " + one.photometric + " " + one.relationship;
    EXPECT_EQ(meaning.is_attenuation, one.is_attenuation) << name;
    EXPECT_EQ(meaning.reversed, one.reversed) << name;
    EXPECT_EQ(meaning.assumed, one.assumed) << name;
  }
}

TEST(PixelMeaningTest, WordsSayWhatIsAssumed) {
  DicomHeader header;
  header.modality = "XA";
  header.photometric = "MONOCHROME2";
  header.relationship = "DRM";
  EXPECT_NE(pixelMeaning(header).in_words.find("DRM, which DICOM does not know"), std::string::npos);
}

}  // namespace
}  // namespace xray_registration

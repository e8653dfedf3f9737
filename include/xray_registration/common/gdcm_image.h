#pragma once

#include <optional>

namespace gdcm {
class File;
class Image;
}  // namespace gdcm

namespace xray_registration {

/// Where a pixel's number lies in its word: BitsStored bits, the uppermost of them HighBit.
struct PixelBits {
  int stored = 0;
  int high = 0;
};

/// The image of a DICOM file that gdcm::Reader has read: its size, its kind of pixels and the pixels themselves, for
/// gdcm::Image::GetBuffer(). Nothing where the file holds none, or none that can be. GDCM clears the bits beside the
/// number in words of 16 bits where it lies lowest, as the standard wants; else the words come as they are, and the
/// image's BitsStored is the word's length.
/// gdcm::ImageReader does this as well, and much more about which nobody here asks (spacing, overlays, icons, tables);
/// as Debian builds it, it ends the process on whatever of that has not the type that the standard wants.
/// Slope and intercept are not applied, nor kept. Any thread, as long as nobody else uses the same file.
std::optional<PixelBits> imageOf(const gdcm::File& file, gdcm::Image* image);

}  // namespace xray_registration

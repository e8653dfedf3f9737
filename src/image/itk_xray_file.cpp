#include "image/itk_xray_file.h"

#include <itkGDCMImageIO.h>
#include <itkImageFileReader.h>
#include <itkMetaDataObject.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "xray_registration/common/itk_quiet.h"
#include "xray_registration/image/xray_image_file.h"

namespace xray_registration {
namespace {

constexpr char kBitsStored[] = "0028|0101";
constexpr std::size_t kLargestSide = 100000;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw XrayFileError("'" + path + "': " + what);
}

void checkHeader(const itk::GDCMImageIO& io, const std::string& path) {
  if (io.GetNumberOfComponents() != 1) refuse(path, "it is a colour image; an X-ray has one number per pixel");
  const std::size_t frames = io.GetNumberOfDimensions() > 2 ? io.GetDimensions(2) : 1;
  if (frames != 1) refuse(path, "it holds " + std::to_string(frames) + " frames; give a file of one");
  for (unsigned axis = 0; axis < 2; ++axis) {
    if (io.GetDimensions(axis) < 1 || io.GetDimensions(axis) > kLargestSide) refuse(path, "its size is impossible");
  }
}

double saturationOf(const itk::GDCMImageIO& io) {
  std::string bits;
  itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), kBitsStored, bits);
  const int count = std::atoi(bits.c_str());
  return std::exp2(count >= 1 && count <= 16 ? count : 16) - 1.0;
}

RawImage read(itk::GDCMImageIO* io, const std::string& path) {
  using Picture = itk::Image<float, 2>;
  io->SetFileName(path);
  io->ReadImageInformation();
  checkHeader(*io, path);
  const auto reader = itk::ImageFileReader<Picture>::New();
  reader->SetImageIO(io);
  reader->SetFileName(path);
  reader->Update();
  const Picture::SizeType size = reader->GetOutput()->GetBufferedRegion().GetSize();
  RawImage raw;
  FloatImage pixels(static_cast<int>(size[0]), static_cast<int>(size[1]));
  std::copy_n(reader->GetOutput()->GetBufferPointer(), pixels.pixels.size(), pixels.pixels.begin());
  raw.pixels = std::move(pixels);
  raw.saturation = saturationOf(*io);
  return raw;
}

}  // namespace

std::optional<RawImage> readXrayDicom(const std::string& path) {
  const QuietItk quiet;
  try {
    const auto io = itk::GDCMImageIO::New();
    if (!io->CanReadFile(path.c_str())) return std::nullopt;
    RawImage raw = read(io.GetPointer(), path);
    if (quiet.pixelsWereIncomplete()) refuse(path, "the file is truncated: it ends before its last pixel");
    return raw;
  } catch (const itk::ExceptionObject& error) {
    refuse(path, std::string("it is DICOM, but no image that can be read: ") + error.GetDescription());
  }
}

}  // namespace xray_registration

#include "itk_image_file.h"

#include <itkGDCMImageIO.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <type_traits>

#include "file_integrity.h"
#include "xray_registration/common/itk_quiet.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

using ImageIo = itk::ImageIOBase;

// Larger than any CT; a broken header must not make the machine run out of memory.
constexpr double kMaxVoxels = 2147483647.0;
// Of the dot product of two axes: about 0.06 degrees. Files store axes as rounded numbers.
constexpr double kAxesTolerance = 1e-3;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

// Runs ITK code and turns its exceptions into ours.
template <typename Work>
auto withItk(const std::string& path, const std::string& task, const Work& work) {
  const QuietItk quiet;
  try {
    auto result = work();
    if (quiet.pixelsWereIncomplete()) refuse(path, "the file is truncated: it ends before its last pixel");
    return result;
  } catch (const itk::ExceptionObject& error) {
    refuse(path, task + ": " + error.GetDescription());
  } catch (const std::bad_alloc&) {
    refuse(path, task + ": not enough memory for the size that its header states");
  }
}

ImageIo::Pointer ioForReading(const std::string& path) {
  for (const ImageIo::Pointer& io :
       {ImageIo::Pointer(itk::NiftiImageIO::New()), ImageIo::Pointer(itk::NrrdImageIO::New()),
        ImageIo::Pointer(itk::MetaImageIO::New()), ImageIo::Pointer(itk::GDCMImageIO::New())}) {
    if (io->CanReadFile(path.c_str())) return io;
  }
  refuse(path, "it is no NIfTI, NRRD, MetaImage or DICOM file, or it is damaged");
}

ImageIo::Pointer ioForWriting(const std::string& path) {
  for (const ImageIo::Pointer& io :
       {ImageIo::Pointer(itk::NiftiImageIO::New()), ImageIo::Pointer(itk::NrrdImageIO::New()),
        ImageIo::Pointer(itk::MetaImageIO::New())}) {
    if (io->CanWriteFile(path.c_str())) return io;
  }
  refuse(path, "the name must end in .nii, .nii.gz, .nrrd, .mha or .mhd");
}

void checkPixels(const ImageIo& io, const std::string& path) {
  if (io.GetNumberOfComponents() != 1) {
    refuse(path, "it has " + std::to_string(io.GetNumberOfComponents()) +
                     " numbers per voxel (a colour or vector image); a CT has one");
  }
  for (unsigned axis = 3; axis < io.GetNumberOfDimensions(); ++axis) {
    if (io.GetDimensions(axis) > 1) refuse(path, "it has more than three dimensions; take one volume out of it");
  }
  if (io.GetNumberOfDimensions() < 3 || io.GetDimensions(2) < 2) {
    refuse(path, "it holds a single slice; a CT volume has several (for DICOM, name the folder)");
  }
}

FileGrid gridOf(const ImageIo& io, const std::string& path) {
  FileGrid grid;
  double voxels = 1.0;
  for (unsigned i = 0; i < 3; ++i) {
    voxels *= static_cast<double>(io.GetDimensions(i));
    grid.size[i] = static_cast<int>(std::min<double>(io.GetDimensions(i), std::numeric_limits<int>::max()));
    grid.spacing_mm[i] = io.GetSpacing(i);
    grid.origin_mm[i] = io.GetOrigin(i);
    const std::vector<double> axis = io.GetDirection(i);
    for (unsigned j = 0; j < 3; ++j) grid.axes[i][j] = axis.at(j);
  }
  if (voxels > kMaxVoxels || voxels < 1.0) refuse(path, "its header states an impossible number of voxels");
  for (std::size_t i = 0; i < 3; ++i) {
    if (grid.size[i] < 2) refuse(path, "it is one voxel thin along an axis");
    if (!(grid.spacing_mm[i] > 0.0 && grid.spacing_mm[i] < 1e4)) refuse(path, "its voxel size is not positive");
    if (!std::isfinite(grid.origin_mm[i])) refuse(path, "its origin is no number");
    for (std::size_t j = 0; j < 3; ++j) {
      double dot = 0.0;
      for (std::size_t k = 0; k < 3; ++k) dot += grid.axes[i][k] * grid.axes[j][k];
      if (!(std::abs(dot - (i == j ? 1.0 : 0.0)) < kAxesTolerance)) {
        refuse(path, "its axes are not at right angles (sheared, as with gantry tilt); resample it first");
      }
    }
  }
  return grid;
}

template <typename To>
constexpr To backgroundOf() {
  return std::is_same<To, std::int16_t>::value ? static_cast<To>(-1000) : static_cast<To>(0);
}

template <typename To, typename From>
To converted(From value) {
  const double number = static_cast<double>(value);
  if (std::isnan(number)) return backgroundOf<To>();
  const double low = std::numeric_limits<To>::lowest();
  const double high = std::numeric_limits<To>::max();
  return static_cast<To>(std::lround(std::min(std::max(number, low), high)));
}

template <typename From, typename To>
void convertAll(const std::vector<char>& bytes, std::size_t count, To* out) {
  const From* in = reinterpret_cast<const From*>(bytes.data());
  for (std::size_t i = 0; i < count; ++i) out[i] = converted<To>(in[i]);
}

template <typename To>
void convertBytes(const ImageIo& io, const std::string& path, const std::vector<char>& bytes, std::size_t count,
                  To* out) {
  switch (io.GetComponentType()) {
    case ImageIo::UCHAR:
      return convertAll<unsigned char>(bytes, count, out);
    case ImageIo::CHAR:
      return convertAll<signed char>(bytes, count, out);
    case ImageIo::USHORT:
      return convertAll<unsigned short>(bytes, count, out);
    case ImageIo::SHORT:
      return convertAll<short>(bytes, count, out);
    case ImageIo::UINT:
      return convertAll<unsigned int>(bytes, count, out);
    case ImageIo::INT:
      return convertAll<int>(bytes, count, out);
    case ImageIo::ULONG:
      return convertAll<unsigned long>(bytes, count, out);
    case ImageIo::LONG:
      return convertAll<long>(bytes, count, out);
    case ImageIo::ULONGLONG:
      return convertAll<unsigned long long>(bytes, count, out);
    case ImageIo::LONGLONG:
      return convertAll<long long>(bytes, count, out);
    case ImageIo::FLOAT:
      return convertAll<float>(bytes, count, out);
    case ImageIo::DOUBLE:
      return convertAll<double>(bytes, count, out);
    default:
      refuse(path, "its voxels have a type that no CT has");
  }
}

// Reads all voxels of the file that `io` has read the header of.
template <typename To>
void readVoxels(ImageIo* io, const std::string& path, std::size_t count, To* out) {
  itk::ImageIORegion region(io->GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io->GetNumberOfDimensions(); ++axis) {
    region.SetIndex(axis, 0);
    region.SetSize(axis, io->GetDimensions(axis));
  }
  io->SetIORegion(region);
  const auto bytes_needed = static_cast<std::size_t>(io->GetImageSizeInBytes());
  if (bytes_needed < count) refuse(path, "its header contradicts itself about its size");
  const bool same_type = (std::is_same<To, std::int16_t>::value && io->GetComponentType() == ImageIo::SHORT) ||
                         (std::is_same<To, std::uint16_t>::value && io->GetComponentType() == ImageIo::USHORT);
  if (same_type && bytes_needed == count * sizeof(To)) {
    io->Read(out);
    return;
  }
  std::vector<char> bytes(bytes_needed);
  io->Read(bytes.data());
  convertBytes(*io, path, bytes, count, out);
}

template <typename To>
FileImage<To> readFile(const std::string& path) {
  return withItk(path, "it cannot be read", [&] {
    const ImageIo::Pointer io = ioForReading(path);
    io->SetFileName(path);
    io->ReadImageInformation();
    checkPixels(*io, path);
    FileImage<To> image;
    image.grid = gridOf(*io, path);
    image.voxels.resize(static_cast<std::size_t>(image.grid.size[0]) * static_cast<std::size_t>(image.grid.size[1]) *
                        static_cast<std::size_t>(image.grid.size[2]));
    const bool is_nifti = dynamic_cast<const itk::NiftiImageIO*>(io.GetPointer()) != nullptr;
    const bool is_meta = dynamic_cast<const itk::MetaImageIO*>(io.GetPointer()) != nullptr;
    if (is_meta) checkMetaImage(path, static_cast<std::size_t>(io->GetImageSizeInBytes()));
    readVoxels(io.GetPointer(), path, image.voxels.size(), image.voxels.data());
    if (is_nifti) {
      scanNifti(path, [&image](std::size_t i, double value) { image.voxels[i] = converted<To>(value); });
    }
    return image;
  });
}

// DICOM text is padded with blanks or zeros to an even length.
std::string trimmed(std::string text) {
  const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
  while (!text.empty() && is_padding(text.back())) text.pop_back();
  while (!text.empty() && is_padding(text.front())) text.erase(text.begin());
  return text;
}

std::string tagOf(const ImageIo& io, const std::string& tag) {
  std::string value;
  itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), tag, value);
  return trimmed(value);
}

// The numbers of a DICOM decimal string, divided by backslashes; false when there are not `count` of them.
bool parseNumbers(const std::string& text, double* numbers, std::size_t count) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  std::string part;
  std::size_t found = 0;
  while (std::getline(stream, part, '\\')) {
    std::istringstream number(part);
    number.imbue(std::locale::classic());
    if (found == count || !(number >> numbers[found]) || !std::isfinite(numbers[found])) return false;
    ++found;
  }
  return found == count;
}

bool parseGeometry(const ImageIo& io, DicomSlice* slice) {
  double orientation[6];
  double spacing[2];
  if (!parseNumbers(tagOf(io, "0020|0032"), slice->position_mm.data(), 3)) return false;
  if (!parseNumbers(tagOf(io, "0020|0037"), orientation, 6)) return false;
  if (!parseNumbers(tagOf(io, "0028|0030"), spacing, 2)) return false;
  std::copy(orientation, orientation + 3, slice->along_row.begin());
  std::copy(orientation + 3, orientation + 6, slice->along_column.begin());
  slice->row_spacing_mm = spacing[0];
  slice->column_spacing_mm = spacing[1];
  return true;
}

template <typename To>
void readSlicePixels(const DicomSlice& slice, To* out) {
  withItk(slice.path, "its pixels cannot be read", [&] {
    const auto io = itk::GDCMImageIO::New();
    io->SetFileName(slice.path);
    io->ReadImageInformation();
    readVoxels<To>(io.GetPointer(), slice.path, static_cast<std::size_t>(slice.rows) * slice.columns, out);
    return true;
  });
}

}  // namespace

FileImage<std::int16_t> readHuFile(const std::string& path) { return readFile<std::int16_t>(path); }

FileImage<std::uint16_t> readLabelFile(const std::string& path) { return readFile<std::uint16_t>(path); }

void writeHuFile(const FileGrid& grid, const std::vector<std::int16_t>& hu, const std::string& path) {
  withItk(path, "it cannot be written", [&] {
    const ImageIo::Pointer io = ioForWriting(path);
    io->SetFileName(path);
    io->SetNumberOfDimensions(3);
    itk::ImageIORegion region(3);
    for (unsigned i = 0; i < 3; ++i) {
      io->SetDimensions(i, static_cast<std::size_t>(grid.size[i]));
      io->SetSpacing(i, grid.spacing_mm[i]);
      io->SetOrigin(i, grid.origin_mm[i]);
      io->SetDirection(i, std::vector<double>(grid.axes[i].begin(), grid.axes[i].end()));
      region.SetIndex(i, 0);
      region.SetSize(i, static_cast<std::size_t>(grid.size[i]));
    }
    io->SetIORegion(region);
    io->SetNumberOfComponents(1);
    io->SetPixelType(ImageIo::SCALAR);
    io->SetComponentType(ImageIo::SHORT);
    io->SetUseCompression(true);
    // The NIfTI library only prints when it cannot write, so the file is opened before and looked through after it.
    if (!std::ofstream(path, std::ios::app)) refuse(path, "it cannot be opened for writing");
    io->Write(hu.data());
    if (dynamic_cast<const itk::NiftiImageIO*>(io.GetPointer()) != nullptr) scanNifti(path, [](std::size_t, double) {});
    return true;
  });
}

std::optional<DicomSlice> readDicomHeader(const std::string& path) {
  const QuietItk quiet;
  try {
    const auto io = itk::GDCMImageIO::New();
    if (!io->CanReadFile(path.c_str())) return std::nullopt;
    io->SetFileName(path);
    io->ReadImageInformation();
    DicomSlice slice;
    slice.path = path;
    slice.series_uid = tagOf(*io, "0020|000e");
    slice.instance_uid = tagOf(*io, "0008|0018");
    slice.modality = tagOf(*io, "0008|0060");
    slice.columns = static_cast<int>(io->GetDimensions(0));
    slice.rows = static_cast<int>(io->GetDimensions(1));
    slice.frames = io->GetNumberOfDimensions() > 2 ? static_cast<int>(io->GetDimensions(2)) : 1;
    slice.components = static_cast<int>(io->GetNumberOfComponents());
    slice.has_geometry = parseGeometry(*io, &slice);
    return slice;
  } catch (const itk::ExceptionObject&) {
    return std::nullopt;  // A report, a dose object or a directory: DICOM, but no image.
  }
}

void readDicomPixels(const DicomSlice& slice, std::int16_t* hu) { readSlicePixels(slice, hu); }

void readDicomPixels(const DicomSlice& slice, std::uint16_t* labels) { readSlicePixels(slice, labels); }

}  // namespace xray_registration

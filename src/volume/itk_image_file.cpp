#include "itk_image_file.h"

#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <type_traits>

#include "byte_stream.h"
#include "file_boundary.h"
#include "file_grid.h"
#include "meta_image.h"
#include "nifti_file.h"
#include "nrrd_header.h"
#include "value_conversion.h"
#include "xray_registration/common/itk_quiet.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

using ImageIo = itk::ImageIOBase;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

// Runs ITK code and turns its exceptions into ours.
template <typename Work>
auto withItk(const std::string& path, const std::string& task, const Work& work) {
  const QuietItk quiet;
  try {
    return work();
  } catch (const itk::ExceptionObject& error) {
    refuse(path, task + ": " + onOneLine(error.GetDescription()));
  } catch (const std::bad_alloc&) {
    refuse(path, task + ": not enough memory for the size that its header states");
  }
}

// What a file is by its first bytes, for the case that its name says otherwise.
std::string kindByContent(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string start(16, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  if (start.rfind("NRRD0", 0) == 0) return "an NRRD; name it .nrrd";
  if (start.rfind("ObjectType", 0) == 0 || start.rfind("NDims", 0) == 0) return "a MetaImage; name it .mha or .mhd";
  if (start.rfind("\x1f\x8b", 0) == 0) return "gzip-compressed, and no NIfTI file within; unpack it with gunzip";
  if (start.rfind("PK", 0) == 0) return "a zip archive; unpack it";
  return "";
}

ImageIo::Pointer ioForReading(const std::string& path) {
  for (const ImageIo::Pointer& io :
       {ImageIo::Pointer(itk::NrrdImageIO::New()), ImageIo::Pointer(itk::MetaImageIO::New())}) {
    if (io->CanReadFile(path.c_str())) return io;
  }
  const std::string kind = kindByContent(path);
  if (!kind.empty()) refuse(path, "its content is " + kind);
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
    refuse(path, "it holds a single slice; a CT volume has several");
  }
}

FileGrid gridOf(const ImageIo& io) {
  FileGrid grid;
  for (unsigned i = 0; i < 3; ++i) {
    grid.size[i] = static_cast<int>(std::min<double>(io.GetDimensions(i), std::numeric_limits<int>::max()));
    grid.spacing_mm[i] = io.GetSpacing(i);
    grid.origin_mm[i] = io.GetOrigin(i);
    const std::vector<double> axis = io.GetDirection(i);
    for (unsigned j = 0; j < 3; ++j) grid.axes[i][j] = axis.at(j);
  }
  return grid;
}

template <typename To>
void convertBytes(const ImageIo& io, const std::string& path, const std::vector<char>& bytes, const FileRule& rule,
                  FileImage<To>* image) {
  const auto convert = [&](auto example) {
    using From = decltype(example);
    convertValues(reinterpret_cast<const From*>(bytes.data()), image->voxels.size(), {}, rule, image->voxels.data(),
                  &image->facts);
  };
  switch (io.GetComponentType()) {
    case ImageIo::UCHAR:
      return convert(static_cast<unsigned char>(0));
    case ImageIo::CHAR:
      return convert(static_cast<signed char>(0));
    case ImageIo::USHORT:
      return convert(static_cast<unsigned short>(0));
    case ImageIo::SHORT:
      return convert(static_cast<short>(0));
    case ImageIo::UINT:
      return convert(0U);
    case ImageIo::INT:
      return convert(0);
    case ImageIo::ULONG:
      return convert(0UL);
    case ImageIo::LONG:
      return convert(0L);
    case ImageIo::ULONGLONG:
      return convert(0ULL);
    case ImageIo::LONGLONG:
      return convert(0LL);
    case ImageIo::FLOAT:
      return convert(0.0F);
    case ImageIo::DOUBLE:
      return convert(0.0);
    default:
      refuse(path, "its voxels have a type that no CT has");
  }
}

// Hands the bytes of all voxels of the file that `io` has read the header of to memory.
using Fill = std::function<void(char*)>;

template <typename To>
void readVoxels(const ImageIo& io, const std::string& path, const FileRule& rule, const Fill& fill,
                FileImage<To>* image) {
  image->voxels.resize(image->grid.voxelCount());
  const auto bytes_needed = static_cast<std::size_t>(io.GetImageSizeInBytes());
  if (bytes_needed < image->voxels.size()) refuse(path, "its header contradicts itself about its size");
  const bool same_type = (std::is_same<To, std::int16_t>::value && io.GetComponentType() == ImageIo::SHORT) ||
                         (std::is_same<To, std::uint16_t>::value && io.GetComponentType() == ImageIo::USHORT);
  if (same_type && changesNothing({}, rule)) {
    fill(reinterpret_cast<char*>(image->voxels.data()));
    return noteValues(image->voxels.data(), image->voxels.size(), &image->facts);
  }
  std::vector<char> bytes(bytes_needed);
  fill(bytes.data());
  convertBytes(io, path, bytes, rule, image);
}

Fill itkReading(ImageIo* io) {
  itk::ImageIORegion region(io->GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io->GetNumberOfDimensions(); ++axis) {
    region.SetIndex(axis, 0);
    region.SetSize(axis, io->GetDimensions(axis));
  }
  io->SetIORegion(region);
  return [io](char* out) { io->Read(out); };
}

void swapBytes(std::size_t number_bytes, std::size_t count, char* bytes) {
  for (std::size_t i = 0; i < count; ++i) std::reverse(bytes + i * number_bytes, bytes + (i + 1) * number_bytes);
}

// ITK takes a compressed MetaImage whose second half is missing, and fills it with zeros.
Fill inflating(const ImageIo& io, const std::string& path, const MetaImageData& data) {
  const auto bytes = static_cast<std::size_t>(io.GetImageSizeInBytes());
  const std::size_t number_bytes = io.GetComponentSize();
  return [path, data, bytes, number_bytes](char* out) {
    inflatePart(path, data.file, data.offset, bytes, out);
    if (data.is_big_endian) swapBytes(number_bytes, bytes / number_bytes, out);
  };
}

template <typename To>
void readNrrd(ImageIo* io, const std::string& path, const FileRule& rule, FileImage<To>* image) {
  // First, since it says in one line what is wrong with a header.
  NrrdHeader header = readNrrdHeader(path, rule);
  io->ReadImageInformation();
  checkPixels(*io, path);
  for (unsigned i = 0; i < 3; ++i) {
    if (static_cast<double>(io->GetDimensions(i)) != header.grid.size[i]) {
      refuse(path, "the order of its axes is not understood; write it with the three axes of space first");
    }
  }
  image->grid = header.grid;
  image->format = "NRRD, " + header.orientation;
  image->warnings = std::move(header.warnings);
  readVoxels(*io, path, rule, itkReading(io), image);
}

// The file of the voxels, as the library understood the header.
void checkDataFile(ImageIo* io, const std::string& path, const FileRule& rule) {
  if (rule.directory.empty()) return;
  const std::string name = dynamic_cast<itk::MetaImageIO&>(*io).GetMetaImagePointer()->ElementDataFileName();
  if (name == "LOCAL" || name == "Local" || name == "local") return;
  if (name.rfind("LIST", 0) == 0 || name.find('%') != std::string::npos) {
    refuse(path, "it refers to several files, which are not read while ct/directory is set");
  }
  checkReferred(path, (std::filesystem::path(path).parent_path() / name).string(), rule.directory);
}

template <typename To>
void readMetaImage(ImageIo* io, const std::string& path, const FileRule& rule, FileImage<To>* image) {
  checkMetaImageDimensions(path);
  // First, since it says what is wrong with a header.
  MetaImageText text = metaImageText(path);
  io->ReadImageInformation();
  checkDataFile(io, path, rule);
  checkPixels(*io, path);
  image->grid = gridOf(*io);
  image->format = "MetaImage, orientation from its matrix";
  image->warnings = std::move(text.warnings);
  if (!text.has_orientation) {
    const std::string letters = rule.orientation.empty() ? "LPS" : rule.orientation;
    image->format = "MetaImage, no orientation, as " + letters;
    turnToLps(letters, &image->grid);
    if (rule.orientation.empty()) {
      image->warnings.push_back(
          "it does not say how its voxels lie (no TransformMatrix). x, y and z are taken to run to the left, back and "
          "head (LPS); if that is wrong, left may be right. ct/orientation says how they run");
    }
  }
  checkGrid(image->grid, path);
  scaleLengths(rule.unit_mm > 0.0 ? rule.unit_mm : text.unit_mm, path, &image->grid);
  const MetaImageData data = metaImageData(path, static_cast<std::size_t>(io->GetImageSizeInBytes()));
  readVoxels(*io, path, rule, data.is_compressed ? inflating(*io, path, data) : itkReading(io), image);
}

template <typename To>
FileImage<To> readFile(const std::string& path, const FileRule& rule) {
  return withItk(path, "it cannot be read", [&] {
    const ImageIo::Pointer io = ioForReading(path);
    io->SetFileName(path);
    FileImage<To> image;
    if (dynamic_cast<const itk::NrrdImageIO*>(io.GetPointer()) != nullptr) {
      readNrrd(io.GetPointer(), path, rule, &image);
    } else {
      readMetaImage(io.GetPointer(), path, rule, &image);
    }
    image.format += ", " + ImageIo::GetComponentTypeAsString(io->GetComponentType());
    return image;
  });
}

}  // namespace

FileImage<std::int16_t> readHuFile(const std::string& path, const FileRule& rule) {
  return readFile<std::int16_t>(path, rule);
}

FileImage<std::uint16_t> readLabelFile(const std::string& path, const FileRule& rule) {
  return readFile<std::uint16_t>(path, rule);
}

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
    if (dynamic_cast<const itk::NiftiImageIO*>(io.GetPointer()) != nullptr) readNiftiHu(path, {});
    return true;
  });
}

}  // namespace xray_registration

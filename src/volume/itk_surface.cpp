#include "itk_surface.h"

#include <itkBinaryMask3DMeshSource.h>
#include <itkImage.h>
#include <itkMesh.h>

#include <algorithm>

#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

using MaskImage = itk::Image<std::uint8_t, 3>;
using Mesh = itk::Mesh<float, 3>;

MaskImage::Pointer imageOf(const std::array<int, 3>& size, const std::vector<std::uint8_t>& mask) {
  MaskImage::SizeType image_size;
  for (unsigned i = 0; i < 3; ++i) image_size[i] = static_cast<itk::SizeValueType>(size[i]);
  const auto image = MaskImage::New();
  image->SetRegions(MaskImage::RegionType(image_size));
  image->Allocate();
  std::transform(mask.begin(), mask.end(), image->GetBufferPointer(),
                 [](std::uint8_t value) { return static_cast<std::uint8_t>(value != 0 ? 1 : 0); });
  return image;
}

}  // namespace

IndexMesh surfaceOfMask(const std::array<int, 3>& size, const std::vector<std::uint8_t>& mask) {
  IndexMesh result;
  try {
    const auto source = itk::BinaryMask3DMeshSource<MaskImage, Mesh>::New();
    source->SetInput(imageOf(size, mask));
    source->SetObjectValue(1);
    source->Update();
    const Mesh* mesh = source->GetOutput();
    result.vertices.reserve(mesh->GetNumberOfPoints());
    for (auto point = mesh->GetPoints()->Begin(); point != mesh->GetPoints()->End(); ++point) {
      const auto& p = point.Value();
      result.vertices.push_back({p[0], p[1], p[2]});
    }
    if (mesh->GetCells() == nullptr) return result;
    result.triangles.reserve(mesh->GetNumberOfCells());
    for (auto cell = mesh->GetCells()->Begin(); cell != mesh->GetCells()->End(); ++cell) {
      const auto* ids = cell.Value()->GetPointIds();
      result.triangles.push_back({static_cast<int>(ids[0]), static_cast<int>(ids[1]), static_cast<int>(ids[2])});
    }
  } catch (const itk::ExceptionObject& error) {
    throw VolumeError(std::string("the bone surface cannot be made: ") + error.GetDescription());
  }
  return result;
}

}  // namespace xray_registration

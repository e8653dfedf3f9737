#include <gdcmAttribute.h>
#include <gdcmImageWriter.h>
#include <gdcmUIDGenerator.h>

#include <cstring>
#include <fstream>
#include <stdexcept>

#include "xray_registration/common/itk_quiet.h"
#include "xray_registration/image/xray_dicom.h"
#include "xray_registration/image/xray_dicom_writer.h"

namespace xray_registration {
namespace {

template <std::uint16_t Group, std::uint16_t Number, typename T>
void set(gdcm::DataSet* set, const T& value) {
  gdcm::Attribute<Group, Number> attribute{};
  attribute.SetValue(value);
  set->Replace(attribute.GetAsDataElement());
}

template <std::uint16_t Group, std::uint16_t Number, typename T>
void setPair(gdcm::DataSet* set, const T& first, const T& second) {
  gdcm::Attribute<Group, Number> attribute{};
  attribute.SetValue(first, 0);
  attribute.SetValue(second, 1);
  set->Replace(attribute.GetAsDataElement());
}

void setGeometry(const XrayAngiogram& run, gdcm::DataSet* data) {
  set<0x0018, 0x1110>(data, run.source_detector_mm);
  set<0x0018, 0x1111>(data, run.source_isocentre_mm);
  set<0x0018, 0x1114>(data, run.source_detector_mm / run.source_isocentre_mm);
  set<0x0018, 0x1500>(data, gdcm::CSComp("STATIC"));
  set<0x0018, 0x1510>(data, run.primary_deg);
  set<0x0018, 0x1511>(data, run.secondary_deg);
  set<0x0018, 0x5100>(data, gdcm::CSComp("HFS"));
  if (run.collimator_radius_px <= 0.0) return;
  // Rows and columns are counted from 1, in whole ones.
  const int row = (run.frames.front().height + 1) / 2;
  const int column = (run.frames.front().width + 1) / 2;
  gdcm::Attribute<0x0018, 0x1700> shape;
  const gdcm::CSComp circular("CIRCULAR");
  shape.SetValues(&circular, 1);
  data->Replace(shape.GetAsDataElement());
  setPair<0x0018, 0x1710>(data, column, row);
  set<0x0018, 0x1712>(data, static_cast<int>(run.collimator_radius_px));
}

void setTimes(const XrayAngiogram& run, gdcm::DataSet* data) {
  if (run.frames.size() < 2) return;
  set<0x0018, 0x1063>(data, 1000.0 * run.frame_time_s);
  gdcm::Attribute<0x0028, 0x0009> pointer;
  pointer.SetNumberOfValues(1);
  pointer.SetValue(0, gdcm::Tag(0x0018, 0x1063));
  data->Replace(pointer.GetAsDataElement());
}

void setAttributes(const XrayAngiogram& run, gdcm::DataSet* data) {
  set<0x0008, 0x0060>(data, gdcm::CSComp("XA"));
  set<0x0008, 0x0070>(data, gdcm::LOComp("xray_registration"));
  set<0x0010, 0x0010>(data, gdcm::PNComp("SIMULATED^PHANTOM"));
  set<0x0010, 0x0020>(data, gdcm::LOComp("SIMULATED-0001"));
  set<0x0010, 0x0030>(data, gdcm::DAComp("19000101"));
  set<0x0020, 0x0011>(data, 1);
  set<0x0020, 0x0013>(data, run.number);
  set<0x0028, 0x1040>(data, gdcm::CSComp("LIN"));
  setGeometry(run, data);
  setTimes(run, data);
}

void setPixels(const XrayAngiogram& run, gdcm::Image* image) {
  const unsigned width = static_cast<unsigned>(run.frames.front().width);
  const unsigned height = static_cast<unsigned>(run.frames.front().height);
  image->SetNumberOfDimensions(3);
  image->SetDimension(0, width);
  image->SetDimension(1, height);
  image->SetDimension(2, static_cast<unsigned>(run.frames.size()));
  // Written as ImagerPixelSpacing, over what the attributes have.
  image->SetSpacing(0, run.pixel_mm);
  image->SetSpacing(1, run.pixel_mm);
  gdcm::PixelFormat format(gdcm::PixelFormat::UINT16);
  format.SetBitsStored(static_cast<unsigned short>(run.bits));
  image->SetPixelFormat(format);
  image->SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  image->SetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
  const std::size_t bytes = 2U * width * height;
  std::vector<char> pixels(bytes * run.frames.size());
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    std::memcpy(pixels.data() + i * bytes, run.frames[i].pixels.data(), bytes);
  }
  gdcm::DataElement element(gdcm::Tag(0x7FE0, 0x0010));
  element.SetByteValue(pixels.data(), static_cast<std::uint32_t>(pixels.size()));
  image->SetDataElement(element);
}

}  // namespace

void writeXrayAngiogram(const std::string& path, const XrayAngiogram& run) {
  if (run.frames.empty() || run.frames.front().empty()) throw std::invalid_argument("a run of X-rays has no frames");
  for (const auto& frame : run.frames) {
    if (frame.width != run.frames.front().width || frame.height != run.frames.front().height) {
      throw std::invalid_argument("the frames of a run differ in size");
    }
  }
  // GDCM ends the process when it cannot open a file.
  if (!std::ofstream(path)) throw XrayDicomError("'" + path + "': cannot be written");
  const QuietItk quiet;
  gdcm::ImageWriter writer;
  setPixels(run, &writer.GetImage());
  gdcm::DataSet& data = writer.GetFile().GetDataSet();
  set<0x0008, 0x0016>(&data, gdcm::UIComp("1.2.840.10008.5.1.4.1.1.12.1"));
  setAttributes(run, &data);
  writer.SetFileName(path.c_str());
  if (!writer.Write()) throw XrayDicomError("'" + path + "': cannot be written");
}

}  // namespace xray_registration

#include "xray_registration/image/xray_dicom.h"

namespace xray_registration {
namespace {

bool showsBonesDark(const DicomHeader& header) {
  // Fluoroscopy and angiography are looked at with bones and vessels dark, radiographs as on film.
  return header.modality == "XA" || header.modality == "RF";
}

/// Whether larger values mean more X-rays.
bool moreIsBrighter(const DicomHeader& header) {
  if (header.has_lut) return true;  // The table's purpose is values that are proportional to the intensity.
  if (header.relationship_sign) return *header.relationship_sign > 0.0;
  const bool black_is_low = header.photometric != "MONOCHROME1";
  return showsBonesDark(header) == black_is_low;
}

std::string scaleInWords(const DicomHeader& header) {
  if (header.has_lut) return "made linear by the file's table";
  const std::string said = "PixelIntensityRelationship " + header.relationship;
  if (header.relationship == "LIN") return said + ", linear";
  if (header.relationship == "LOG") return said + ", the logarithm";
  if (header.relationship == "DISP") return said + ", for displays: some curve of the intensity";
  if (!header.relationship.empty()) return said + ", which DICOM does not know; taken for a display's curve";
  return header.modality == "CR" ? "no PixelIntensityRelationship; a logarithm, as CR plates are read"
                                 : "no PixelIntensityRelationship; taken for a display's curve";
}

}  // namespace

PixelMeaning pixelMeaning(const DicomHeader& header) {
  PixelMeaning meaning;
  const bool logarithm =
      !header.has_lut && (header.relationship == "LOG" || (header.relationship.empty() && header.modality == "CR"));
  const bool more_is_brighter = moreIsBrighter(header);
  meaning.is_attenuation = logarithm;
  meaning.reversed = logarithm == more_is_brighter;
  meaning.assumed =
      !header.has_lut && (header.relationship.empty() || !(header.relationship_sign || showsBonesDark(header)));
  meaning.in_words =
      scaleInWords(header) + "; larger values mean " + (more_is_brighter ? "more" : "fewer") + " X-rays (" +
      (header.relationship_sign || header.has_lut ? "stated" : header.photometric + " of " + header.modality) + ")";
  if (meaning.reversed) meaning.in_words += "; written reversed";
  return meaning;
}

}  // namespace xray_registration

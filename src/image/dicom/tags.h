#pragma once

#include "image/dicom/data_set.h"

/// The attributes that are read, by the names of DICOM PS3.6.
namespace xray_registration::dicom::tag {

constexpr Tag kSopClassUid = 0x00080016;
constexpr Tag kAcquisitionTime = 0x00080032;
constexpr Tag kModality = 0x00080060;
constexpr Tag kPresentationIntentType = 0x00080068;
constexpr Tag kRecommendedDisplayFrameRate = 0x00082144;
constexpr Tag kCineRate = 0x00180040;
constexpr Tag kFrameTime = 0x00181063;
constexpr Tag kFrameTimeVector = 0x00181065;
constexpr Tag kDistanceSourceToDetector = 0x00181110;
constexpr Tag kDistanceSourceToPatient = 0x00181111;
constexpr Tag kEstimatedRadiographicMagnificationFactor = 0x00181114;
constexpr Tag kFieldOfViewShape = 0x00181147;
constexpr Tag kFieldOfViewDimensions = 0x00181149;
constexpr Tag kIntensifierSize = 0x00181162;
constexpr Tag kImagerPixelSpacing = 0x00181164;
constexpr Tag kPositionerPrimaryAngle = 0x00181510;
constexpr Tag kPositionerSecondaryAngle = 0x00181511;
constexpr Tag kPositionerPrimaryAngleIncrement = 0x00181520;
constexpr Tag kPositionerSecondaryAngleIncrement = 0x00181521;
constexpr Tag kDetectorPrimaryAngle = 0x00181530;
constexpr Tag kDetectorSecondaryAngle = 0x00181531;
/// Of the shutter; the collimator's are as many above 0x00181700. Shape, left and right vertical edge, upper and lower
/// horizontal edge, centre and radius of the circle, vertices of the polygon.
constexpr Tag kShutter = 0x00181600;
constexpr Tag kCollimator = 0x00181700;
constexpr Tag kPatientPosition = 0x00185100;
constexpr Tag kViewPosition = 0x00185101;
constexpr Tag kDetectorBinning = 0x0018701A;
constexpr Tag kDetectorElementSpacing = 0x00187022;
constexpr Tag kDetectorActiveDimensions = 0x00187026;
constexpr Tag kDetectorActiveOrigin = 0x00187028;
constexpr Tag kFieldOfViewOrigin = 0x00187030;
constexpr Tag kFieldOfViewRotation = 0x00187032;
constexpr Tag kFieldOfViewHorizontalFlip = 0x00187034;
constexpr Tag kFrameAcquisitionDateTime = 0x00189074;
constexpr Tag kDistanceSourceToIsocenter = 0x00189402;
constexpr Tag kPhysicalDetectorSize = 0x00189429;
constexpr Tag kPositionOfIsocenterProjection = 0x00189430;
constexpr Tag kFieldOfViewDimensionsInFloat = 0x00189461;
constexpr Tag kSeriesInstanceUid = 0x0020000E;
constexpr Tag kInstanceNumber = 0x00200013;
constexpr Tag kPatientOrientation = 0x00200020;
constexpr Tag kPhotometricInterpretation = 0x00280004;
constexpr Tag kPixelSpacing = 0x00280030;
constexpr Tag kPixelSpacingCalibrationType = 0x00280A02;
constexpr Tag kPixelIntensityRelationship = 0x00281040;
constexpr Tag kPixelIntensityRelationshipSign = 0x00281041;
constexpr Tag kWindowCenter = 0x00281050;
constexpr Tag kRescaleIntercept = 0x00281052;
constexpr Tag kRescaleSlope = 0x00281053;
constexpr Tag kLossyImageCompression = 0x00282110;
constexpr Tag kModalityLutSequence = 0x00283000;
constexpr Tag kLutDescriptor = 0x00283002;
constexpr Tag kLutData = 0x00283006;
constexpr Tag kVoiLutSequence = 0x00283010;
constexpr Tag kPixelIntensityRelationshipLutSequence = 0x00289422;

}  // namespace xray_registration::dicom::tag

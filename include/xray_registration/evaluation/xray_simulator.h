#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// A metal part fixed in the camera frame: capsule from a to b (equal ends make a ball). It adds to what the CT
/// attenuates; what it displaces is not taken away.
struct Instrument {
  Eigen::Vector3d a_camera_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d b_camera_mm = Eigen::Vector3d::Zero();
  double radius_mm = 2.0;
  double attenuation_per_mm = 0.3;
};

/// Length in mm inside the instrument of the ray from the source along `direction_camera` (any length but zero).
double instrumentChordMm(const Instrument& instrument, const Eigen::Vector3d& direction_camera);

/// What the tube, the patient and the detector do to the line integrals.
struct XrayPhysics {
  double photons_per_pixel = 20000.0;  ///< Unattenuated beam; 0 = no photon noise, counts as with 20000 photons.
  double readout_noise = 5.0;          ///< Standard deviation in detector counts.
  double scatter_fraction = 0.2;       ///< Of the primary, as a blurred veil.
  double scatter_sigma_px = 30.0;
  double gain = 2.0;  ///< Detector counts per photon.
  double saturation = 65535.0;
  double collimator_radius_px = 0.0;  ///< Round field about the image's centre; 0 = open.
  int samples_per_pixel_axis = 1;     ///< n × n rays per pixel, whose intensities are averaged as a detector does.
  std::vector<Instrument> instruments;
};

/// A part of what is in the beam, at its place. The volume must outlive its use.
struct PosedVolume {
  const AttenuationVolume* volume = nullptr;
  RigidTransform T_camera_volume = RigidTransform::Identity();
};

/// A detector image (mono16 transmission) of the CT at a pose: exact projector, Beer-Lambert, scatter, Poisson and
/// readout noise, gain, saturation. The same generator state gives the same image. Scatter comes from the patient and
/// so reaches the detector behind the collimator's blades as well.
/// @throws std::invalid_argument for a camera with a problem or a physical quantity out of range.
Image<std::uint16_t> simulateXray(const AttenuationVolume& volume, const RigidTransform& T_camera_ct,
                                  const XrayCamera& camera, const XrayPhysics& physics, std::mt19937_64* random);

/// The same of several parts, whose line integrals add.
Image<std::uint16_t> simulateXray(const std::vector<PosedVolume>& parts, const XrayCamera& camera,
                                  const XrayPhysics& physics, std::mt19937_64* random);

}  // namespace xray_registration

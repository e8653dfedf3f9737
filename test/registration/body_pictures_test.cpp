// A registrar's pictures of the parts of a CT.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "xray_registration/drr/device.h"
#include "xray_registration/registration/fast_registrar.h"
#include "xray_registration/volume/body_cut.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

TEST(BodyPictures, OfAllPartsAddUpToTheWholeCtsWhereItHasThem) {
  const LabelledPhantom phantom = labelledPelvisPhantom(5.0);
  const AttenuationModel model;
  const CutCt parts =
      cutBodies(phantom.ct, model, phantom.labels, {{phantom.names.at("hip_left")}, {phantom.names.at("femur_right")}});
  FastRegistrar registrar(std::make_shared<Device>("auto", Logger{}), RegistrarOptions{}, Logger{});
  registrar.setVolume(toAttenuation(phantom.ct, model));
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() = rotationFromVector(Eigen::Vector3d(1.5, 0.1, 0.1));
  T_camera_ct.translation() = Eigen::Vector3d(0.0, 0.0, 800.0) - T_camera_ct.linear() * registrar.centreCt();
  const XrayCamera camera{64, 48, 120.0, 120.0, 31.5, 23.5};
  EXPECT_EQ(registrar.renderParts(camera, T_camera_ct, {}).size(), 1U);  // It has no bodies yet.

  registrar.setBodies(parts.rest, {{"hip", parts.bodies[0]}, {"femur", parts.bodies[1]}});
  const FloatImage whole = registrar.renderDrr(camera, T_camera_ct);
  const std::vector<FloatImage> images = registrar.renderParts(camera, T_camera_ct, {T_camera_ct, T_camera_ct});
  ASSERT_EQ(images.size(), 3U);
  double difference = 0.0;
  for (std::size_t i = 0; i < whole.pixels.size(); ++i) {
    const float sum = images[0].pixels[i] + images[1].pixels[i] + images[2].pixels[i];
    difference = std::max<double>(difference, std::abs(sum - whole.pixels[i]));
  }
  const float largest = *std::max_element(whole.pixels.begin(), whole.pixels.end());
  EXPECT_GT(*std::max_element(images[1].pixels.begin(), images[1].pixels.end()), 0.02F * largest);
  EXPECT_GT(*std::max_element(images[2].pixels.begin(), images[2].pixels.end()), 0.02F * largest);
  // The march is linear in the voxels; only its sums are rounded, and a part's box ends elsewhere.
  EXPECT_LT(difference, 1e-3 * largest);
}

}  // namespace
}  // namespace xray_registration

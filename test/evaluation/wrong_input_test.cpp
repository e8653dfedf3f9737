#include "xray_registration/evaluation/wrong_input.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

RawView someView(const std::string& name, float phase) {
  RawView view;
  view.name = name;
  view.image = RawImage{FloatImage(96, 96), 65535.0};
  // Waves of 30 pixels, no symmetry.
  for (int v = 0; v < 96; ++v) {
    for (int u = 0; u < 96; ++u) {
      view.image->pixels.floats.at(u, v) =
          20000.0F + 10000.0F * std::sin(0.2F * u + phase) * std::cos(0.15F * v + 0.4F);
    }
  }
  view.calibration.width = view.calibration.height = 96;
  view.calibration.k = {200, 0, 47.0, 0, 210, 48.0, 0, 0, 1};
  view.T_view_first.translation().x() = name == "ap" ? 0.0 : 500.0;
  return view;
}

std::vector<RawView> someViews() { return {someView("ap", 0.0F), someView("oblique", 1.0F)}; }

/// What of a view differs, by name; k's entries by their number.
std::string changesOf(const RawView& before, const RawView& after) {
  std::string changed;
  EXPECT_EQ(before.name, after.name);
  if (before.image->pixels.floats.pixels != after.image->pixels.floats.pixels) changed += "pixels ";
  for (std::size_t i = 0; i < 9; ++i) {
    if (before.calibration.k[i] != after.calibration.k[i]) changed += "k" + std::to_string(i) + " ";
  }
  if (before.calibration.distortion != after.calibration.distortion) changed += "d ";
  if (!before.T_view_first.isApprox(after.T_view_first, 1e-12)) changed += "pose ";
  return changed;
}

/// What the text changes of each of the two views.
std::vector<std::string> changesBy(const std::string& text) {
  const std::vector<RawView> before = someViews();
  std::vector<RawView> after = before;
  tellWrong({parseWrongInput(text)}, &after);
  return {changesOf(before[0], after[0]), changesOf(before[1], after[1])};
}

using Changes = std::vector<std::string>;

TEST(WrongInput, ChangesWhatItSaysAndNothingElse) {
  EXPECT_EQ(changesBy("focal_length:1.02"), (Changes{"k0 k4 ", "k0 k4 "}));
  EXPECT_EQ(changesBy("focal_length:1.02:oblique"), (Changes{"", "k0 k4 "}));
  EXPECT_EQ(changesBy("principal_point:12,-3px"), (Changes{"k2 k5 ", "k2 k5 "}));
  EXPECT_EQ(changesBy("principal_point:12,0:ap"), (Changes{"k2 ", ""}));
  EXPECT_EQ(changesBy("distortion:0.5:ap"), (Changes{"pixels ", ""}));
  EXPECT_EQ(changesBy("distortion:s_shape,3px"), (Changes{"pixels ", "pixels "}));
  EXPECT_EQ(changesBy("view_pose:1deg,2mm"), (Changes{"", "pose "}));
  EXPECT_EQ(changesBy("mirrored_image:left_right:oblique"), (Changes{"", "pixels "}));
  EXPECT_EQ(changesBy("mirrored_image:up_down"), (Changes{"pixels ", "pixels "}));
  EXPECT_EQ(changesBy("turned_image:90:ap"), (Changes{"pixels ", ""}));
  EXPECT_EQ(changesBy("inverted_image"), (Changes{"pixels ", "pixels "}));
  EXPECT_EQ(changesBy("inverted_image:oblique"), (Changes{"", "pixels "}));
  EXPECT_EQ(changesBy("exchanged_views"), (Changes{"pixels ", "pixels "}));
  for (const std::string ct : {"ct_scale:1.03", "mirrored_ct", "sheared_ct:0.03", "bent_ct:4mm"}) {
    EXPECT_EQ(changesBy(ct), (Changes{"", ""})) << ct;
    EXPECT_TRUE(parseWrongInput(ct).change_ct) << ct;
  }
}

TEST(WrongInput, TellsTheSuspicionThatWouldBeRight) {
  EXPECT_EQ(parseWrongInput("focal_length:1.02").what, "focal_length");
  EXPECT_EQ(parseWrongInput("bent_ct:4mm,seed3").what, "other_patient");
  EXPECT_EQ(parseWrongInput("bent_ct:4mm,seed3").text, "bent_ct:4mm,seed3");
}

TEST(WrongInput, NumbersArriveWhereTheyBelong) {
  std::vector<RawView> views = someViews();
  tellWrong({parseWrongInput("focal_length:1.02:ap"), parseWrongInput("principal_point:12,-3:ap")}, &views);
  EXPECT_DOUBLE_EQ(views[0].calibration.k[0], 204.0);
  EXPECT_DOUBLE_EQ(views[0].calibration.k[4], 214.2);
  EXPECT_DOUBLE_EQ(views[0].calibration.k[2], 59.0);
  EXPECT_DOUBLE_EQ(views[0].calibration.k[5], 45.0);
}

TEST(WrongInput, AViewIsTurnedAboutItsSource) {
  constexpr double kDegree = 3.14159265358979323846 / 180.0;
  for (const std::string text : {"view_pose:1deg,2mm,y,z", "view_pose:1,2,seed7:oblique", "view_pose:1deg,2mm"}) {
    const RigidTransform before = someViews()[1].T_view_first;
    std::vector<RawView> views = someViews();
    tellWrong({parseWrongInput(text)}, &views);
    EXPECT_NEAR(rotationAngleBetween(views[1].T_view_first, before), 1.0 * kDegree, 1e-9) << text;
    // Its own source, the origin of its axes, moves by the distance alone.
    const RigidTransform offset = views[1].T_view_first * before.inverse();
    EXPECT_NEAR(offset.translation().norm(), 2.0, 1e-9) << text;
    if (text.find(",y,z") == std::string::npos) continue;
    EXPECT_LT((offset.translation() - Eigen::Vector3d(0.0, 0.0, 2.0)).norm(), 1e-9);
    EXPECT_LT((offset.linear() * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  }
  std::vector<RawView> once = someViews();
  std::vector<RawView> other = someViews();
  tellWrong({parseWrongInput("view_pose:1deg,2mm,seed1")}, &once);
  tellWrong({parseWrongInput("view_pose:1deg,2mm,seed2")}, &other);
  EXPECT_FALSE(once[1].T_view_first.isApprox(other[1].T_view_first, 1e-6));
}

TEST(WrongInput, ExchangedTwiceIsTheSame) {
  const WrongInput exchanged = parseWrongInput("exchanged_views");
  std::vector<RawView> views = someViews();
  tellWrong({exchanged}, &views);
  EXPECT_EQ(views[0].image->pixels.floats.pixels, someViews()[1].image->pixels.floats.pixels);
  tellWrong({exchanged}, &views);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(changesOf(someViews()[i], views[i]), "");
}

TEST(WrongInput, ADistortionIsWhatCameraInfoWouldSay) {
  RawView view = someView("ap", 0.0F);
  const XrayFrame straight = makeXrayFrame(view.image->pixels, 65535.0, view.calibration, {});
  std::vector<RawView> views = {view};
  tellWrong({parseWrongInput("distortion:-1")}, &views);
  const auto largestDifference = [&](const Calibration& calibration) {
    const XrayFrame frame = makeXrayFrame(views[0].image->pixels, 65535.0, calibration, {});
    float largest = 0.0F;
    // Inside, where no border was repeated.
    for (int v = 12; v < 84; ++v) {
      for (int u = 12; u < 84; ++u) {
        largest = std::max(largest, std::abs(frame.attenuation.at(u, v) - straight.attenuation.at(u, v)));
      }
    }
    return largest;
  };
  Calibration told = view.calibration;
  told.distortion_model = "plumb_bob";
  told.distortion = {-1.0, 0.0, 0.0, 0.0, 0.0};
  // Two bilinear interpolations, each off by up to an eighth of the second derivatives along u and v: (0.04 + 0.0225) a
  // pixel² where the waves are darkest, and half as much again where the distortion draws them together.
  EXPECT_LT(largestDifference(told), 0.02F);
  EXPECT_GT(largestDifference(view.calibration), 0.1F);
}

TEST(WrongInput, AppliesToTheCt) {
  const Volume right = whiteCube(16);
  Volume ct = right;
  tellWrong({parseWrongInput("ct_scale:1.04,0.96,1.03"), parseWrongInput("focal_length:1.02")}, &ct);
  EXPECT_TRUE(ct.grid.spacing_mm.isApprox(right.grid.spacing_mm.cwiseProduct(Eigen::Vector3d(1.04, 0.96, 1.03))));
  ct = right;
  tellWrong({parseWrongInput("ct_scale:0.5"), parseWrongInput("ct_scale:2")}, &ct);
  EXPECT_TRUE(ct.grid.sameAs(right.grid));
}

TEST(WrongInput, AnotherCtIsRead) {
  Volume other = whiteCube(16, 50.0);
  other.hu[7] = 123;
  other.grid.origin_ct_mm += Eigen::Vector3d(100.0, 50.0, -20.0);
  const std::string path = testing::TempDir() + "wrong_input_" + std::to_string(getpid()) + ".nii.gz";
  writeVolume(other, path);
  Volume ct = whiteCube(8);
  const Eigen::Vector3d centre_ct_mm = ct.grid.centreCt();
  tellWrong({parseWrongInput("other_ct:" + path)}, &ct);
  std::remove(path.c_str());
  EXPECT_EQ(ct.hu, other.hu);
  // NIfTI keeps positions in float.
  EXPECT_LT((ct.grid.centreCt() - centre_ct_mm).norm(), 1e-4);
  EXPECT_THROW(tellWrong({parseWrongInput("other_ct:" + path)}, &ct), VolumeError);
}

std::string complaintAbout(const std::string& text) {
  try {
    parseWrongInput(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(WrongInput, RefusesWhatItDoesNotUnderstand) {
  for (const std::string text : {"focal_length",
                                 "focal_length:",
                                 "focal_length:abc",
                                 "focal_length:1.02mm",
                                 "focal_length:0",
                                 "focal_length:nan",
                                 "focal_length:1.02,1.03",
                                 "focal_length:1.02:ap:oblique",
                                 "principal_point:12",
                                 "distortion:s_shape",
                                 "distortion:round,3",
                                 "view_pose:1deg",
                                 "view_pose:1mm,2deg",
                                 "view_pose:1deg,2mm,x",
                                 "view_pose:1deg,2mm,x,w",
                                 "ct_scale:1.04,0.96",
                                 "ct_scale:1.03:ap",
                                 "mirrored_image",
                                 "mirrored_image:sideways",
                                 "turned_image:45",
                                 "inverted_image:ap:oblique",
                                 "exchanged_views:ap",
                                 "mirrored_ct:1",
                                 "bent_ct:4mm,3",
                                 "other_ct:"}) {
    const std::string complaint = complaintAbout(text);
    EXPECT_NE(complaint.find("'" + text + "'"), std::string::npos) << text << " → " << complaint;
    EXPECT_NE(complaint.find("allowed: " + text.substr(0, text.find(':'))), std::string::npos) << complaint;
  }
  EXPECT_NE(complaintAbout("magic:1").find("allowed: focal_length, principal_point"), std::string::npos);
  EXPECT_NE(complaintAbout("").find("allowed"), std::string::npos);
}

TEST(WrongInput, RefusesAViewThatIsNotThere) {
  std::vector<RawView> one = {someView("ap", 0.0F)};
  std::vector<RawView> two = someViews();
  EXPECT_THROW(tellWrong({parseWrongInput("inverted_image:lateral")}, &two), std::invalid_argument);
  EXPECT_THROW(tellWrong({parseWrongInput("view_pose:1deg,2mm:ap")}, &two), std::invalid_argument);
  EXPECT_THROW(tellWrong({parseWrongInput("view_pose:1deg,2mm")}, &one), std::invalid_argument);
  EXPECT_THROW(tellWrong({parseWrongInput("exchanged_views")}, &one), std::invalid_argument);
}

TEST(WrongInput, EveryKindIsExplained) {
  for (const std::string kind :
       {"focal_length", "principal_point", "distortion", "view_pose", "ct_scale", "mirrored_image", "turned_image",
        "inverted_image", "exchanged_views", "mirrored_ct", "sheared_ct", "bent_ct", "other_ct"}) {
    EXPECT_NE(("\n" + wrongInputKinds()).find("\n  " + kind), std::string::npos) << kind;
  }
}

}  // namespace
}  // namespace xray_registration

#include <cmath>

#include "phantom_shapes.h"

// Not a person: ellipsoids and rods with the sizes and HU of a head, and no symmetry that would make a pose ambiguous.

namespace xray_registration {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSoftTissueHu = 40.0;
constexpr double kFatHu = -80.0;
constexpr double kCavityHu = -960.0;
constexpr double kMetalHu = 3000.0;

const Vector3d kCentreCtMm(4.0, -17.0, 52.0);

enum Bone { kNone, kSkull, kMandible, kC2, kC3, kC4, kC5 };

// Between the joints of the jaw, about the phantom's centre.
const Vector3d kJawAxis(0.0, -2.0, -18.0);

void addSoftTissue(ShapeList* head) {
  head->add({0, 5, 28}, {79, 98, 84}, kFatHu);
  head->add({0, 5, 28}, {76, 95, 81}, kSoftTissueHu);
  head->add({0, -33, -36}, {63, 67, 72}, kFatHu);
  head->add({0, -32, -35}, {60, 64, 70}, kSoftTissueHu);
  head->add({0, 30, -68}, {54, 56, 45}, kSoftTissueHu);
  head->add({0, -74, -74}, {38, 33, 36}, kSoftTissueHu);
  head->add({1, -98, -20}, {13, 12, 23}, kSoftTissueHu);
  head->add({81, 16, 0}, {7, 18, 29}, kSoftTissueHu, {0, 0, 20});
  head->add({-80, 13, -3}, {6, 16, 30}, kSoftTissueHu, {0, 0, -20});
}

void addCranium(ShapeList* head) {
  head->add({0, 5, 30}, {70, 90, 76}, 950);      // Outer table,
  head->add({0, 5, 30}, {68, 87.5, 73.5}, 420);  // spongy bone,
  head->add({0, 5, 30}, {66, 85, 71}, 900);      // inner table;
  head->add({1.5, 3, 32}, {63.5, 81, 69}, 36);   // the brain sits off centre: uneven thickness.
  head->addPieces(160, {0, 5, 30}, {68, 88, 74}, 0.96, {2.0, 5.5}, {150, 1250});
  head->addBone({0, 92, 8}, {14, 6, 10}, 2.0);        // Occipital protuberance.
  head->add({2, 0, 97}, {1.6, 62, 4}, 250);           // A suture's groove.
  head->add({10, 5, 40}, {5, 30, 7}, 6, {15, 0, 8});  // Ventricles,
  head->add({-11, 9, 42}, {7, 33, 8}, 6, {15, 0, -6});
  head->add({0, 18, 30}, {2.5, 3, 3}, 250);  // pineal gland, calcified,
  head->add({-21, 24, 24}, {4, 5, 4}, 180);  // and choroid plexus on one side.
}

void addBase(ShapeList* head) {
  head->addBone({41, 14, -12}, {27, 10, 10}, 2.5, {0, 8, 35}, 1400, 700);  // Petrous bones,
  head->addBone({-43, 12, -14}, {26, 11, 9}, 2.5, {0, -6, -32}, 1400, 650);
  head->add({36, 10, -12}, {3, 3, 3}, 1900);  // labyrinths,
  head->add({-37, 9, -13}, {3, 3, 3.5}, 1900);
  head->addBone({58, 26, -26}, {11, 14, 19}, 2.0);  // mastoids with their cells,
  head->addBone({-57, 27, -24}, {12, 13, 21}, 2.0);
  head->addPieces(24, {58, 26, -26}, {9, 11, 15}, 0.0, {1.5, 3.0}, {-850, -500});
  head->addPieces(16, {-57, 27, -24}, {9, 10, 16}, 0.0, {1.5, 3.5}, {-850, -500});
  head->addBone({0, -16, -20}, {22, 22, 14}, 2.5);  // sphenoid with sella and sinus,
  head->add({0, -6, -9}, {6, 7, 5}, kSoftTissueHu);
  head->add({3, -20, -21}, {13, 12, 8}, kCavityHu);
  head->addBone({0, 14, -34}, {15, 28, 7}, 2.0, {-38, 0, 0});  // clivus.
}

void addFace(ShapeList* head) {
  head->addBone({0, -62, -36}, {33, 30, 27}, 2.0, Vector3d::Zero(), 800, 180);  // Maxilla.
  for (const double side : {1.0, -1.0}) {
    const double size = side > 0 ? 1.0 : 0.94;
    head->addBone({side * 32, -66, 0}, size * Vector3d(23, 25, 21), 2.2, {0, 0, side * 12}, 850, 850);  // Orbits:
    head->add({side * 33, -71, 0}, size * Vector3d(19, 25, 17), kFatHu, {0, 0, side * 12});             // fat,
    head->add({side * 33, -80, 0}, size * Vector3d(12, 12, 12), 15);                                    // eye,
    head->add({side * 33, -86.5, 0}, Vector3d(4.5, 2, 4.5), 90);                                        // lens.
    head->addBone({side * 49, -56, -18}, size * Vector3d(13, 21, 9), 2.0, {0, 0, side * 35});
    head->addRod({side * 55, -50, -16}, {side * 65, 4, -14}, 3.5 * size, 850);  // Arches.
  }
  head->add({24, -61, -28}, {13, 17, 15}, kCavityHu);  // Sinuses: maxillary,
  head->add({-23, -62, -30}, {11, 15, 13}, kCavityHu);
  head->add({9, -82, 27}, {15, 5, 11}, kCavityHu);  // frontal,
  head->add({-10, -81, 23}, {8, 4, 7}, kCavityHu);
  head->add({1, -74, -28}, {9, 24, 17}, kCavityHu);  // nasal cavity
  head->add({2, -74, -28}, {1.2, 24, 17}, 300, {0, 4, 0});
  head->add({6, -72, -33}, {2.5, 19, 6}, 60);
  head->add({-6, -74, -31}, {2, 17, 5}, 60);
  head->addPieces(18, {0, -58, -8}, {11, 17, 9}, 0.0, {2.0, 4.0}, {-900, -600});  // and ethmoid cells.
  head->addRod({0, -88, 0}, {1, -101, -14}, 3.0, 600);                            // Nasal bone.
}

void addJawAndTeeth(ShapeList* head) {
  head->setLabel(kMandible);
  for (const double side : {1.0, -1.0}) {
    const double lean = side > 0 ? 0.0 : 2.0;
    head->addRod({side * 8, -84, -88 + lean}, {side * 42, -36, -78}, 8.5, 950);
    head->addRod({side * 8, -84, -88 + lean}, {side * 42, -36, -78}, 5.5, 350);
    head->addRod({side * 45, -34, -82}, {side * 50, -6 + lean, -24}, 7.5, 950);
    head->addRod({side * 45, -34, -82}, {side * 50, -6 + lean, -24}, 4.0, 350);
    head->addBone({side * 51, -3 + lean, -22}, {9, 5, 6}, 1.5);
  }
  head->addBone({0, -88, -90}, {14, 8, 11}, 2.5, Vector3d::Zero(), 1000, 400);
  for (int tooth = -7; tooth <= 7; ++tooth) {
    const double x = 4.6 * tooth;
    const double y = -90 + 0.035 * x * x;
    head->setLabel(kSkull);
    if (tooth != 4) head->add({x, y, -59}, {2.8, 3.0, 8.5}, tooth == -6 ? kMetalHu : 1900);
    head->setLabel(kMandible);
    if (tooth != -3 && tooth != 5) head->add({0.95 * x, y + 2, -75}, {2.6, 2.8, 8.0}, 1850);
  }
}

void addNeck(ShapeList* head) {
  head->setLabel(kNone);
  head->add({0, -6, -66}, {9, 7, 40}, kCavityHu);  // Airway.
  for (int level = 0; level < 4; ++level) {
    head->setLabel(kC2 + level);
    const double z = -50 - 15.0 * level;
    const double y = 30 + 1.5 * level;
    head->addBone({0, y, z}, {15.0 + level, 10.5, 7.0}, 1.5, {5.0, 2.0 * level, 0}, 800, 280);
    head->addBone({19, y + 6, z}, {8, 6, 6}, 1.5, {0, 20, 10});
    head->addBone({-19, y + 6.5, z + 1}, {7.5, 6, 6}, 1.5, {0, -20, -10});
    head->addRod({0, y + 22, z}, {1.5, y + 36, z - 5}, 3.5, 750);
  }
  head->setLabel(kC2);
  head->addRod({0, 28, -48}, {0, 27, -30}, 5.0, 900);  // Dens.
  head->setLabel(kNone);
  head->addRod({-14, -28, -90}, {15, -30, -88}, 3.0, 600);  // Hyoid.
  head->add({30, 2, -84}, {5, 5, 10}, 170);                 // A calcified carotid on one side.
}

ShapeList headShapes() {
  ShapeList head(kCentreCtMm);
  addSoftTissue(&head);
  head.setLabel(kSkull);
  addCranium(&head);
  addBase(&head);
  addFace(&head);
  addJawAndTeeth(&head);
  addNeck(&head);
  head.add({68, -48, 55}, {2.5, 2.5, 2.5}, kMetalHu);  // The marker, on the left temple.
  return head;
}

}  // namespace

Volume headPhantom(double spacing_mm) {
  Volume volume = paintPhantom(phantomGrid({184, 224, 234}, spacing_mm, kCentreCtMm), headShapes().shapes());
  volume.name = "head phantom";
  return volume;
}

LabelledPhantom labelledHeadPhantom(double spacing_mm) {
  LabelledPhantom phantom;
  phantom.ct = headPhantom(spacing_mm);
  phantom.labels = paintLabels(phantom.ct, headShapes().shapes());
  phantom.names = {{"skull", kSkull}, {"mandible", kMandible}, {"C2", kC2}, {"C3", kC3}, {"C4", kC4}, {"C5", kC5}};
  phantom.joints_ct_mm = {{"mandible", kJawAxis + kCentreCtMm}};
  return phantom;
}

}  // namespace xray_registration

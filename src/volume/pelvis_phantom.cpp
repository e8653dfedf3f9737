#include "phantom_shapes.h"

// Not a person: ellipsoids and rods with the sizes and HU of a pelvis; left and right differ.

namespace xray_registration {
namespace {

using Eigen::Vector3d;

constexpr double kMuscleHu = 50.0;
constexpr double kFatHu = -95.0;
constexpr double kGasHu = -960.0;

const Vector3d kCentreCtMm(-6.0, 21.0, -310.0);

enum Bone { kNone, kFemurLeft, kFemurRight, kHipLeft, kHipRight, kSacrum, kL5, kL4 };

// Of a femur and its socket, about the phantom's centre.
Vector3d headOf(double side) { return {side * 92, 6, -22}; }

void addBody(ShapeList* pelvis) {
  // Much longer than the volume: the body goes on beyond both ends.
  pelvis->add({0, 0, 20}, {174, 114, 700}, kFatHu);
  pelvis->add({0, 6, 20}, {156, 92, 700}, kMuscleHu);
  pelvis->add({2, -28, 40}, {98, 48, 70}, -60);              // Fat between the organs.
  pelvis->add({0, -38, -45}, {38, 30, 28}, 8);               // Bladder.
  pelvis->add({68, 62, -30}, {45, 30, 70}, 60, {0, 12, 0});  // Gluteal muscles.
  pelvis->add({-70, 60, -28}, {47, 28, 66}, 55, {0, -12, 0});
  pelvis->add({58, -62, -100}, {12, 10, 60}, kFatHu);  // Groins.
  pelvis->add({-60, -60, -100}, {13, 11, 60}, kFatHu);
}

void addGas(ShapeList* pelvis) {
  pelvis->add({88, -12, 62}, {17, 15, 42}, 20);  // Colon with gas in it,
  pelvis->add({88, -18, 68}, {12, 9, 26}, kGasHu);
  pelvis->add({92, -16, 30}, {8, 7, 9}, kGasHu);
  pelvis->add({-82, -20, 70}, {14, 12, 16}, kGasHu, {0, 30, 0});
  pelvis->add({-28, -48, 58}, {18, 9, 8}, kGasHu, {0, 20, 15});
  pelvis->add({34, -50, 88}, {22, 8, 7}, kGasHu, {0, -25, 0});
  pelvis->add({4, 45, -62}, {11, 12, 24}, -100);
  pelvis->add({5, 40, -58}, {7, 6, 13}, kGasHu);  // and the rectum's.
}

void addSpine(ShapeList* pelvis) {
  for (int level = 0; level < 3; ++level) {
    pelvis->setLabel(level < 2 ? kL5 + level : kNone);  // The third is nearly all beyond the end.
    const double z = 78 + 33.0 * level;
    const double y = 22 - 3.0 * level;
    pelvis->addBone({0, y, z}, {25.0 - level, 17, 13.5}, 1.8, {-10.0 + 5.0 * level, 2, 0}, 750, 190);
    pelvis->add({0, y + 26, z}, {9, 8, 14}, 15);
    pelvis->addBone({0, y + 40, z - 3}, {4, 15, 9}, 1.5, {12, 0, 2});
    pelvis->addRod({14, y + 24, z}, {46, y + 28, z + 3}, 4.5, 650);
    pelvis->addRod({-14, y + 24, z}, {-43, y + 30, z + 1}, 4.5, 650);
    pelvis->addBone({18, y + 29, z - 8}, {7, 8, 11}, 1.8);
    pelvis->addBone({-18, y + 29, z - 7}, {7.5, 8, 11}, 1.8);
  }
  pelvis->setLabel(kSacrum);
  pelvis->addBone({0, 38, 46}, {50, 19, 20}, 1.8, {-35, 2, 0}, 700, 170);  // Sacrum,
  pelvis->addBone({1, 52, 22}, {40, 13, 18}, 1.8, {-20, 0, 0}, 700, 170);
  pelvis->addBone({2, 60, -3}, {27, 9, 16}, 1.8, {5, 0, 0}, 700, 170);
  pelvis->addBone({3, 55, -26}, {15, 7, 13}, 1.8, {25, 0, 0}, 650, 200);
  for (int level = 0; level < 4; ++level) {  // its foramina,
    const double z = 48 - 17.0 * level;
    pelvis->add({22.0 - 3 * level, 44.0 + 4 * level, z}, {4, 13, 4}, 20, {-20, 0, 0});
    pelvis->add({-21.0 + 3 * level, 44.0 + 4 * level, z - 1}, {4.2, 13, 3.8}, 20, {-20, 0, 0});
  }
  pelvis->addRod({4, 52, -38}, {7, 40, -54}, 4.5, 550);  // coccyx.
}

void addHipBone(ShapeList* pelvis, double side) {
  const double size = side > 0 ? 1.0 : 0.96;
  pelvis->setLabel(side > 0 ? kHipLeft : kHipRight);
  const auto at = [side, size](double x, double y, double z) { return Vector3d(side * size * x, y, size * z); };
  // Iliac wing: thick rim, thin in the middle.
  pelvis->addBone(at(88, 14, 52), size * Vector3d(11, 62, 50), 3.0, {-14, side * 24, side * 34}, 850, 260);
  pelvis->add(at(80, 8, 56), size * Vector3d(13, 44, 32), kMuscleHu, {-14, side * 24, side * 34});
  pelvis->addBone(at(86, 12, 54), size * Vector3d(3.2, 46, 36), 1.2, {-14, side * 24, side * 34}, 800, 300);
  pelvis->addBone(at(58, 46, 40), size * Vector3d(12, 18, 26), 2.5, {0, 0, side * 40});           // Sacroiliac part.
  pelvis->addBone(at(78, 4, 2), size * Vector3d(19, 24, 27), 3.0);                                // Above the socket.
  pelvis->addBone(at(88, 8, -20), size * Vector3d(33, 33, 33), 4.0, Vector3d::Zero(), 950, 350);  // Socket.
  pelvis->addRod(at(70, -18, -18), at(10, -52, -40), 9.0, 900);  // Pubis, upper branch,
  pelvis->addRod(at(70, -18, -18), at(10, -52, -40), 6.0, 250);
  pelvis->addBone(at(13, -50, -48), size * Vector3d(10, 9, 18), 2.0, {20, side * 8, 0});  // beside the symphysis,
  pelvis->addRod(at(14, -46, -60), at(52, 4, -88), 6.5, 800);                             // lower branch.
  pelvis->addRod(at(14, -46, -60), at(52, 4, -88), 3.8, 300);
  pelvis->addBone(at(62, 26, -72), size * Vector3d(15, 18, 28), 2.8, {-20, side * 10, 0});  // Ischium.
  pelvis->addPieces(side > 0 ? 30 : 24, at(90, 16, 54), size * Vector3d(12, 46, 36), 0.5, {2.0, 4.5}, {80, 900});
  pelvis->addPieces(14, at(62, 26, -72), size * Vector3d(10, 13, 20), 0.0, {2.0, 4.0}, {100, 650});
}

void addFemur(ShapeList* pelvis, double side) {
  pelvis->setLabel(side > 0 ? kFemurLeft : kFemurRight);
  const double turn = side > 0 ? 0.0 : 5.0;  // The right leg is turned a little further in.
  const Vector3d head = headOf(side);
  const Vector3d trochanter(side * 142, 16 + turn, -42);
  const Vector3d shaft(side * 132, 10 + turn, -62);
  const Vector3d below(side * 112, 4 + turn, -330);
  pelvis->add(head, {28, 28, 28}, 30);          // Joint space,
  pelvis->addRod(head, trochanter, 15.0, 950);  // neck,
  pelvis->addRod(head, trochanter, 11.0, 260);
  pelvis->addBone(head, {24, 24, 24}, 2.0, Vector3d::Zero(), 1000, 380);
  pelvis->addBone(trochanter, {13, 20, 23}, 2.0, {0, side * 15, 0});
  pelvis->addBone({side * 116, 24 + turn, -82}, {9, 10, 13}, 2.0);  // lesser trochanter,
  pelvis->addRod(shaft, below, 16.0, 1300);                         // shaft with its marrow.
  pelvis->addRod(shaft, below, 8.5, -20);
  pelvis->addPieces(20, head, {20, 20, 20}, 0.0, {2.0, 4.5}, {250, 800});
  pelvis->addPieces(16, 0.5 * (head + trochanter), {24, 9, 11}, 0.0, {1.5, 3.5}, {120, 700});
}

ShapeList pelvisShapes() {
  ShapeList pelvis(kCentreCtMm);
  addBody(&pelvis);
  addGas(&pelvis);
  addSpine(&pelvis);
  for (const double side : {1.0, -1.0}) {
    addHipBone(&pelvis, side);
    addFemur(&pelvis, side);
  }
  pelvis.setLabel(kNone);
  pelvis.add({-3, -52, -46}, {3.0, 6, 14}, 60, {20, 0, 0});  // Symphysis.
  pelvis.add({32, 10, -64}, {2.5, 2.5, 2.5}, 1200);          // Phleboliths, on one side only.
  pelvis.add({44, 16, -58}, {2.0, 2.0, 2.0}, 900);
  pelvis.add({-50, -22, 18}, {3.5, 2.5, 9}, 500, {0, 25, 0});  // A calcified vessel.
  return pelvis;
}

}  // namespace

Volume pelvisPhantom(double spacing_mm) {
  Volume volume = paintPhantom(phantomGrid({360, 240, 260}, spacing_mm, kCentreCtMm), pelvisShapes().shapes());
  volume.name = "pelvis phantom";
  return volume;
}

LabelledPhantom labelledPelvisPhantom(double spacing_mm) {
  LabelledPhantom phantom;
  phantom.ct = pelvisPhantom(spacing_mm);
  phantom.labels = paintLabels(phantom.ct, pelvisShapes().shapes());
  phantom.names = {{"femur_left", kFemurLeft},
                   {"femur_right", kFemurRight},
                   {"hip_left", kHipLeft},
                   {"hip_right", kHipRight},
                   {"sacrum", kSacrum},
                   {"L5", kL5},
                   {"L4", kL4}};
  phantom.joints_ct_mm = {{"femur_left", headOf(1.0) + kCentreCtMm}, {"femur_right", headOf(-1.0) + kCentreCtMm}};
  return phantom;
}

}  // namespace xray_registration

// A recorded session with known poses, from the exact projector.
#include <sensor_msgs/image_encodings.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "tools/common/command_line.h"
#include "tools/common/ct_options.h"
#include "tools/common/ct_source.h"
#include "tools/common/json_files.h"
#include "tools/common/progress_bar.h"
#include "tools/common/session_generator.h"
#include "tools/common/session_messages.h"
#include "tools/simulate_session/dicom_output.h"
#include "xray_registration/ros/bag_session.h"
#include "xray_registration/volume/volume_io.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

struct Arguments {
  CtSource ct;
  std::string output;
  std::string dicom;
  std::string json;
  std::string views = "ap:0";
  std::size_t frames = 40;
  double rate_hz = 10.0;
  double first_stamp_s = 1000.0;
  std::string mask;
  std::string labels;
  std::string joint;
  SessionSetup setup;
};

void addOptions(CLI::App& app, Arguments& arguments) {
  auto* ct = app.add_option("--ct", arguments.ct.path, "CT: NIfTI, NRRD, MetaImage or a DICOM folder")
                 ->check(CLI::ExistingPath);
  app.add_option("--phantom", arguments.ct.phantom, "one of the project's phantoms instead of a CT")
      ->check(CLI::IsMember({"head", "pelvis", "cube"}))
      ->excludes(ct);
  addCtReadOptions(app, &arguments.ct.read);
  app.add_option("--spacing", arguments.ct.spacing_mm, "voxels of the phantom, mm")->capture_default_str();
  app.add_option("--output", arguments.output, "the bag to write");
  app.add_option("--dicom", arguments.dicom,
                 "a folder for the X-rays as a C-arm stores them: <view>.dcm, XA, multi-frame; with or without a bag");
  app.add_option("--json", arguments.json,
                 "the true poses; default: beside the bag, with .json for .bag, else session.json in --dicom");
  app.add_option("--views", arguments.views, "NAME:DEGREES,…; 0 is antero-posterior, 90 lateral")
      ->capture_default_str();
  app.add_option("--frames", arguments.frames, "number of frames")->check(CLI::Range(1, 100000))->capture_default_str();
  app.add_option("--rate", arguments.rate_hz, "frames per second")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  app.add_option("--first-stamp", arguments.first_stamp_s, "stamp of the first frame, s")
      ->check(CLI::Range(1.0, 4e9))
      ->capture_default_str();
}

void addBodyOptions(CLI::App& app, Arguments& arguments) {
  SessionBodies& bodies = arguments.setup.bodies;
  auto* labels = app.add_option("--labels", arguments.labels,
                                "NAME:LABEL,…: bodies that move on their own; truth on /<view>/ground_truth/<NAME>");
  app.add_option("--mask", arguments.mask, "label image of --ct; a phantom has its own (make_phantom --labels)")
      ->check(CLI::ExistingFile)
      ->needs(labels);
  app.add_option("--body-rotation", bodies.rotation_deg, "largest rotation of a body against the rest, degrees")
      ->needs(labels)
      ->capture_default_str();
  app.add_option("--body-translation", bodies.translation_mm, "largest shift of a body's centre, mm")
      ->needs(labels)
      ->capture_default_str();
  app.add_option("--joint", arguments.joint,
                 "NAME:DEGREES[:X,Y,Z]: this body swings about the CT's left-right axis through the point (mm, LPS; "
                 "default: the phantom's joint, or the body's centre), there and back in a period; above zero, what is "
                 "below the axis goes to the back")
      ->needs(labels);
}

void addSetupOptions(CLI::App& app, SessionSetup& setup) {
  const auto number = [&app](const char* name, auto& value, const char* text) {
    app.add_option(name, value, text)->capture_default_str();
  };
  number("--seed", setup.seed, "of motion and noise");
  number("--amplitude-mm", setup.amplitude_mm, "largest motion along each axis of the CT, mm");
  number("--amplitude-deg", setup.amplitude_deg, "largest rotation about each axis of the CT, degrees");
  number("--period", setup.period_s, "after so many seconds the motion repeats itself");
  number("--size", setup.image_size, "pixels per side");
  number("--detector-mm", setup.detector_mm, "side of the detector, mm");
  number("--source-detector-mm", setup.source_detector_mm, "distance, mm");
  number("--source-centre-mm", setup.source_centre_mm, "distance from the source to the CT's centre, mm");
  number("--photons", setup.physics.photons_per_pixel, "of the open beam per pixel; 0 is without photon noise");
  number("--readout-noise", setup.physics.readout_noise, "standard deviation, counts");
  number("--scatter", setup.physics.scatter_fraction, "of the primary beam, as a blurred veil");
  number("--gain", setup.physics.gain, "counts per photon");
  number("--collimator-px", setup.physics.collimator_radius_px, "radius of a round collimator; 0 is open");
  number("--water-attenuation", setup.attenuation.water_per_mm, "of water, 1/mm");
  app.add_flag("--instrument", setup.instrument, "a metal rod and ball that do not move with the patient");
}

std::string jsonPath(const Arguments& arguments) {
  if (!arguments.json.empty()) return arguments.json;
  if (arguments.output.empty()) return std::filesystem::path(arguments.dicom) / "session.json";
  return std::filesystem::path(arguments.output).replace_extension(".json");
}

/// Stamps are whole microseconds, so that they survive any way of writing them.
double frameTime(const Arguments& arguments, std::size_t frame) {
  return std::round(1e6 * static_cast<double>(frame) / arguments.rate_hz) / 1e6;
}

/// Where the frames go; either may be missing.
struct Outputs {
  std::optional<BagSessionWriter> bag;
  std::optional<DicomOutput> dicom;
};

nlohmann::json writeFrames(const Arguments& arguments, const SessionGenerator& generator, Outputs* outputs) {
  const auto views = bagViews(generator);
  auto& bag = outputs->bag;
  if (bag) bag->writeViews(views, ros::Time(arguments.first_stamp_s));
  nlohmann::json frames = nlohmann::json::array();
  ProgressBar progress("rendering", arguments.frames);
  for (std::size_t i = 0; i < arguments.frames; ++i) {
    const double time_s = frameTime(arguments, i);
    const ros::Time stamp(arguments.first_stamp_s + time_s);
    nlohmann::json frame = {{"stamp", stamp.toSec()}};
    for (std::size_t v = 0; v < views.size(); ++v) {
      const RigidTransform T_camera_ct = generator.cameraFromCt(v, time_s);
      const Image<std::uint16_t> xray = generator.xray(v, i, time_s);
      if (bag) {
        const auto image = imageMessage(xray, views[v].frame_id, stamp);
        bag->writeImage(views[v], image, cameraInfoMessage(generator.camera(), views[v].frame_id, stamp));
        bag->writeGroundTruth(views[v], stamp, T_camera_ct);
      }
      if (outputs->dicom) outputs->dicom->add(v, xray);
      nlohmann::json& view = frame["views"][views[v].name];
      view = {{"T_camera_ct", toJson(T_camera_ct)}};
      const auto& bodies = generator.setup().bodies.bodies;
      for (std::size_t b = 0; b < bodies.size(); ++b) {
        const RigidTransform T_camera_body = generator.cameraFromBody(v, b, time_s);
        if (bag) bag->writeBodyGroundTruth(views[v], stamp, bodies[b].name, T_camera_body);
        view["bodies"][bodies[b].name] = toJson(T_camera_body);
      }
    }
    frames.push_back(frame);
    progress.advanceTo(i + 1);
  }
  return frames;
}

/// A CT, and labels when bodies are named.
struct LabelledCt {
  Volume ct;
  LabelVolume labels;
};

LabelledCt loadLabelledCt(const Arguments& arguments, SessionBodies* bodies) {
  const Logger logger = standardErrorLogger("simulate_session", false);
  if (arguments.labels.empty()) return {loadCt(arguments.ct, logger), {}};
  if (!arguments.mask.empty())
    return {loadCt(arguments.ct, logger), readLabels(arguments.mask, arguments.ct.read, logger)};
  if (!arguments.ct.path.empty()) throw ArgumentError("--labels: a CT needs --mask, the image that the labels are in");
  LabelledPhantom phantom = loadLabelledPhantom(arguments.ct);
  if (bodies->joint && !bodies->joint->pivot_ct_mm) {
    const auto joint = phantom.joints_ct_mm.find(bodies->joint->body);
    if (joint != phantom.joints_ct_mm.end()) bodies->joint->pivot_ct_mm = joint->second;
  }
  return {std::move(phantom.ct), std::move(phantom.labels)};
}

nlohmann::json toJsonList(const Eigen::Vector3d& point) { return {point.x(), point.y(), point.z()}; }

void describeBodies(const Arguments& arguments, const SessionGenerator& generator, nlohmann::json* description) {
  const auto& bodies = generator.setup().bodies.bodies;
  if (bodies.empty()) return;
  (*description)["labels"] = arguments.labels;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    (*description)["centres_lps_mm"][bodies[b].name] = toJsonList(generator.bodyCentreCt(b));
  }
}

void run(const Arguments& arguments) {
  if (arguments.output.empty() && arguments.dicom.empty()) throw ArgumentError("--output is required, or --dicom");
  if (!arguments.output.empty()) {
    requireWritableParent(arguments.output, "--output");
    if (std::filesystem::path(arguments.output).extension() != ".bag") {
      throw ArgumentError("--output " + arguments.output + ": must end in .bag");
    }
  }
  if (!arguments.json.empty() || !arguments.output.empty()) requireWritableParent(jsonPath(arguments), "--json");
  SessionSetup setup = arguments.setup;
  const LabelledCt labelled = loadLabelledCt(arguments, &setup.bodies);
  const Volume& ct = labelled.ct;
  const SessionGenerator generator(ct, setup, labelled.labels);
  Outputs outputs;
  if (!arguments.output.empty()) outputs.bag.emplace(arguments.output);
  if (!arguments.dicom.empty()) outputs.dicom.emplace(arguments.dicom, generator, 1.0 / arguments.rate_hz);
  const nlohmann::json frames = writeFrames(arguments, generator, &outputs);
  if (outputs.bag) outputs.bag->close();
  if (outputs.dicom) outputs.dicom->write();
  nlohmann::json description = {
      {"ct", std::filesystem::path(ct.name).filename().string()},
      {"centre_lps_mm", toJsonList(generator.centreCt())},
      {"convention", "T_camera_ct maps CT points (DICOM LPS, mm) into the X-ray optical frame"},
      {"frames", frames}};
  describeBodies(arguments, generator, &description);
  if (arguments.setup.views.size() > 1) description["T_view0_view1"] = toJson(generator.viewFromFirst(1).inverse());
  writeJson(jsonPath(arguments), description);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Simulates a session: X-rays of a CT that moves smoothly, with its true poses. The same arguments give the "
      "same images.",
      "simulate_session");
  addOptions(app, arguments);
  addSetupOptions(app, arguments.setup);
  addBodyOptions(app, arguments);
  return runTool(app, argc, argv, [&] {
    arguments.setup.views = parseViews(arguments.views);
    arguments.setup.bodies.bodies = parseBodies(arguments.labels);
    if (!arguments.joint.empty()) arguments.setup.bodies.joint = parseJoint(arguments.joint);
    run(arguments);
  });
}

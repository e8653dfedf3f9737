// X-rays in DICOM as a session: images, their geometry, a first pose.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>

#include "tools/common/command_line.h"
#include "tools/common/ct_source.h"
#include "tools/common/json_files.h"
#include "tools/dicom_to_bag/dicom_runs.h"
#include "tools/dicom_to_bag/dicom_session.h"
#include "tools/dicom_to_bag/dicom_views.h"
#include "tools/dicom_to_bag/inspection.h"
#include "xray_registration/volume/attenuation.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

struct Arguments {
  std::vector<std::string> inputs;
  std::string output;
  bool inspect = false;
  std::string views;
  std::string json;
  CtSource ct;
  std::string isocentre_ct_mm;
  std::string pixel_mm;
  std::string principal_point_px;
  GivenGeometry given;
  std::optional<ImageKind> kind;
  double frame_rate_hz = 1.0;
  double first_stamp_s = 1000.0;
};

void addOptions(CLI::App& app, Arguments& arguments) {
  app.add_option("--input,input", arguments.inputs,
                 "X-rays in DICOM (XA, RF, DX, CR, …): files, or folders that are read with all below")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--output", arguments.output, "the bag to write; beside it go its parameters, .yaml, and masks");
  app.add_flag("--inspect", arguments.inspect, "write no bag: print what the files say and what is missing");
  app.add_option("--json", arguments.json, "the same for programs");
  app.add_option("--views", arguments.views,
                 "a,b: names of the views, in the order of the files (default: xray, or view1,view2)");
  auto* ct = app.add_option("--ct", arguments.ct.path,
                            "CT whose middle lies in the isocentre, for a first pose: NIfTI, NRRD, MetaImage or a "
                            "DICOM folder (default: the CT's origin lies there)")
                 ->check(CLI::ExistingPath);
  app.add_option("--isocentre-ct-mm", arguments.isocentre_ct_mm, "X,Y,Z: where the CT has the isocentre, LPS")
      ->excludes(ct);
  app.add_option("--first-stamp", arguments.first_stamp_s, "stamp of the first picture, s; never the patient's date")
      ->check(CLI::Range(1.0, 4e9))
      ->capture_default_str();
  app.add_option("--frame-rate", arguments.frame_rate_hz, "pictures per second where the files do not say")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
}

/// What the files lack; these win over what they say.
void addGeometryOptions(CLI::App& app, Arguments& arguments) {
  GivenGeometry& given = arguments.given;
  app.add_option("--source-detector-mm", given.source_detector_mm, "distance from the source to the detector")
      ->check(CLI::Range(50.0, 20000.0));
  app.add_option("--source-patient-mm", given.source_isocentre_mm, "distance from the source to the isocentre")
      ->check(CLI::Range(10.0, 20000.0));
  app.add_option("--pixel-mm", arguments.pixel_mm, "size of a stored pixel on the detector: P, or ROW,COLUMN spacing");
  app.add_option("--principal-point-px", arguments.principal_point_px,
                 "COLUMN,ROW of the stored picture where the ray at right angles to the detector arrives, from 0");
  app.add_option("--primary-deg", given.primary_deg,
                 "positioner angle: where the detector is about the patient, 0 in front, left side (LAO) above zero")
      ->check(CLI::Range(-360.0, 360.0));
  app.add_option("--secondary-deg", given.secondary_deg, "the same towards the head (CRA above zero)")
      ->check(CLI::Range(-90.0, 90.0));
  app.add_option_function<std::string>(
         "--mirrored", [&given](const std::string& word) { given.mirrored = word == "yes"; },
         "yes: the stored picture is as seen from the detector; no: as seen from the source")
      ->check(CLI::IsMember({"yes", "no"}));
  app.add_option_function<std::string>(
         "--kind",
         [&arguments](const std::string& word) {
           arguments.kind = word == "transmission"  ? ImageKind::kTransmission
                            : word == "attenuation" ? ImageKind::kAttenuation
                                                    : ImageKind::kInverted;
         },
         "what the stored values are, written as they are: transmission, attenuation, inverted")
      ->check(CLI::IsMember({"transmission", "attenuation", "inverted"}));
}

RowColumn pixelSize(const std::string& text) {
  const auto parts = splitList(text);
  const auto [row, column] = parts.size() == 1
                                 ? std::make_pair(parseNumber(text, "--pixel-mm"), parseNumber(text, "--pixel-mm"))
                                 : parsePair(text, "--pixel-mm");
  if (!(row > 0.0 && column > 0.0)) throw ArgumentError("--pixel-mm " + text + ": must be above zero");
  return {row, column};
}

Eigen::Vector3d point(const std::string& text, const char* option) {
  const auto parts = splitList(text);
  if (parts.size() != 3) throw ArgumentError(std::string(option) + ": '" + text + "' is not three numbers as 'x,y,z'");
  return {parseNumber(parts[0], option), parseNumber(parts[1], option), parseNumber(parts[2], option)};
}

void readTexts(Arguments* arguments) {
  if (!arguments->pixel_mm.empty()) arguments->given.pixel_mm = pixelSize(arguments->pixel_mm);
  if (!arguments->principal_point_px.empty()) {
    const auto [u, v] = parsePair(arguments->principal_point_px, "--principal-point-px");
    arguments->given.principal_point_px = Eigen::Vector2d(u, v);
  }
  if (arguments->inspect) return;
  if (arguments->output.empty()) throw ArgumentError("--output is required, or --inspect");
  if (std::filesystem::path(arguments->output).extension() != ".bag") {
    throw ArgumentError("--output " + arguments->output + ": must end in .bag");
  }
  requireWritableParent(arguments->output, "--output");
}

void checkName(const std::string& name) {
  const bool is_word =
      std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
  if (!is_word || std::isdigit(static_cast<unsigned char>(name.front())) != 0) {
    throw ArgumentError("--views: '" + name + "' is no name for a topic: letters, digits and _, a letter first");
  }
}

/// Never from a file's name, which may be a patient's.
void nameViews(const std::string& text, bool only_inspected, std::vector<DicomRun>* runs) {
  const auto names = splitList(text);
  for (const std::string& name : names) {
    checkName(name);
    if (std::count(names.begin(), names.end(), name) > 1) throw ArgumentError("--views: '" + name + "' is named twice");
  }
  if (!names.empty() && names.size() != runs->size()) {
    throw ArgumentError("--views names " + std::to_string(names.size()) + " views, but the input holds " +
                        std::to_string(runs->size()) + " runs of X-rays (see --inspect)");
  }
  if (names.empty() && runs->size() > 2 && !only_inspected) {
    throw ArgumentError("the input holds " + std::to_string(runs->size()) +
                        " runs of X-rays, which hardly are views of one moment: name the files of one or two (see "
                        "--inspect), or all with --views");
  }
  for (std::size_t i = 0; i < runs->size(); ++i) {
    (*runs)[i].view = !names.empty() ? names[i] : runs->size() == 1 ? "xray" : "view" + std::to_string(i + 1);
  }
}

/// All that is missing of all views, and how to give it.
void requireGeometry(const std::vector<DicomView>& views) {
  std::string problem;
  std::string for_pose;
  for (const DicomView& view : views) {
    const std::optional<std::size_t> picture = incompletePicture(view);
    if (!picture) continue;
    const DicomGeometry& geometry = view.geometries[*picture];
    for (const MissingGeometry& one : geometry.missing) {
      std::string& text = one.for_pose ? for_pose : problem;
      text += (text.empty() ? "" : "; ") + one.what + ": give " + one.remedy;
    }
    const auto& pixel = geometry.pixel_mm;
    if (pixel.value && pixel.estimate)
      problem += "; size of a pixel, only an estimate from " + pixel.source + ": give --pixel-mm";
    if (*picture > 0) problem += " (picture " + std::to_string(*picture + 1) + ")";
    if (views.size() > 1) problem += " (view " + view.name() + ")";
  }
  if (problem.empty()) return;
  throw std::runtime_error("the files do not state the geometry: " + problem +
                           (for_pose.empty() ? "" : ". For a first pose also: " + for_pose));
}

void requireOneKind(const std::vector<DicomView>& views) {
  for (const DicomView& view : views) {
    if (view.kind == views.front().kind) continue;
    throw std::runtime_error("view " + view.name() + " is of image/kind " + nameOf(view.kind) + ", " +
                             views.front().name() + " of " + nameOf(views.front().kind) +
                             ": convert them one by one, or say --kind");
  }
}

Eigen::Vector3d isocentreCt(const Arguments& arguments, const Logger& logger) {
  if (!arguments.isocentre_ct_mm.empty()) return point(arguments.isocentre_ct_mm, "--isocentre-ct-mm");
  if (!arguments.ct.path.empty()) return anatomicalCentreCt(toAttenuation(loadCt(arguments.ct, logger), {}));
  log(logger, LogLevel::kWarning,
      "the first pose has the CT's origin in the isocentre; give --ct or --isocentre-ct-mm for a better one");
  return Eigen::Vector3d::Zero();
}

void warnOf(const std::vector<DicomView>& views, const Logger& logger) {
  for (const DicomView& view : views) {
    const DicomGeometry& geometry = view.geometry();
    for (const std::string& warning : geometry.warnings) log(logger, LogLevel::kWarning, view.name() + ": " + warning);
    for (const MissingGeometry& one : geometry.missing) {
      log(logger, LogLevel::kWarning, view.name() + ": no first pose without the " + one.what + ": give " + one.remedy);
    }
    if (geometry.mirrored.estimate) {
      log(logger, LogLevel::kWarning,
          view.name() + ": whether the picture is mirrored is not known without angles: give --mirrored");
    }
    if (!view.run->times_are_known) {
      log(logger, LogLevel::kWarning, view.name() + ": the times of the pictures are not stated: --frame-rate is used");
    }
  }
}

void say(const std::vector<DicomView>& views, const WrittenSession& written) {
  for (const DicomView& view : views) {
    const XrayCamera& camera = *view.geometry().camera;
    std::printf("%s: %zu pictures, image/kind %s (%s), fx %.2f fy %.2f cx %.2f cy %.2f px%s%s\n", view.name().c_str(),
                view.run->pictures.size(), nameOf(view.kind), view.meaning.in_words.c_str(), camera.fx, camera.fy,
                camera.cx, camera.cy, *view.geometry().mirrored.value ? ", columns reversed" : "",
                view.mask.empty() ? "" : ", shutters masked");
  }
  std::printf("first pose: %s\nparameters: %s\n",
              written.T_first_ct ? "on /initialpose, and in the parameters" : "none", written.config.c_str());
}

void convert(const Arguments& arguments, const std::vector<DicomView>& views, const Logger& logger) {
  requireGeometry(views);
  requireOneKind(views);
  warnOf(views, logger);
  const bool has_pose = views.front().geometry().T_camera_isocentre.has_value();
  const Eigen::Vector3d isocentre = has_pose ? isocentreCt(arguments, logger) : Eigen::Vector3d::Zero();
  const WrittenSession written = writeDicomSession(arguments.output, views, isocentre, arguments.first_stamp_s);
  if (!written.views_are_connected) {
    log(logger, LogLevel::kWarning,
        "the views' relative pose is not known; registering takes one of them, or /tf_static from elsewhere");
  }
  say(views, written);
}

void run(const Arguments& arguments) {
  const Logger logger = standardErrorLogger("dicom_to_bag", false);
  auto runs = readDicomRuns(arguments.inputs, 1.0 / arguments.frame_rate_hz, logger);
  nameViews(arguments.views, arguments.inspect, &runs);
  std::vector<DicomView> views;
  views.reserve(runs.size());
  for (const DicomRun& one : runs) views.push_back(dicomView(one, arguments.given, arguments.kind));
  if (!arguments.json.empty()) {
    nlohmann::json json;
    for (const DicomView& view : views) json["views"][view.name()] = inspectionJson(view);
    writeJson(arguments.json, json);
  }
  if (arguments.inspect) {
    for (const DicomView& view : views) printInspection(view);
  } else {
    convert(arguments, views, logger);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Makes a session (a bag with images, CameraInfo and a first pose) of X-rays in DICOM. What the files do not "
      "state "
      "is named and can be given. No name, number or date of a patient gets into what is written.",
      "dicom_to_bag");
  addOptions(app, arguments);
  addGeometryOptions(app, arguments);
  return runTool(app, argc, argv, [&] {
    readTexts(&arguments);
    run(arguments);
  });
}

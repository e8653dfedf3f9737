// One DRR of a CT from a camera and a pose.
#include <filesystem>
#include <memory>

#include "tools/common/command_line.h"
#include "tools/common/ct_options.h"
#include "tools/common/ct_source.h"
#include "tools/common/image_files.h"
#include "tools/common/yaml_files.h"
#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/registration/registrar_factory.h"
#include "xray_registration/volume/attenuation.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

struct Arguments {
  CtSource ct;
  std::string camera;
  std::string pose;
  std::string output;
  std::string device = "auto";
  std::string method = "fast";
  AttenuationModel attenuation;
  bool verbose = false;
};

FloatImage render(const Arguments& arguments, const Logger& logger) {
  const XrayCamera camera = readCameraFile(arguments.camera);
  const RigidTransform T_camera_ct = readPoseFile(arguments.pose);
  const AttenuationVolume volume = toAttenuation(loadCt(arguments.ct, logger), arguments.attenuation);
  if (arguments.method == "exact") return referenceProjection(volume, T_camera_ct, camera);
  RegistrarOptions options;
  options.method = arguments.method == "paper" ? Method::kPaper : Method::kFast;
  const auto registrar = makeRegistrar(std::make_shared<Device>(arguments.device, logger), options, logger);
  registrar->setVolume(volume);
  return registrar->renderDrr(camera, T_camera_ct);
}

void run(const Arguments& arguments) {
  const std::string extension = std::filesystem::path(arguments.output).extension();
  if (extension != ".png" && extension != ".mha") {
    throw ArgumentError("--output " + arguments.output + ": must end in .png (8 bits, for the eyes) or .mha (floats)");
  }
  requireWritableParent(arguments.output, "--output");
  const FloatImage drr = render(arguments, standardErrorLogger("render", arguments.verbose));
  if (extension == ".mha") {
    writeMha(arguments.output, drr);
  } else {
    writeGreyPng(arguments.output, drr);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Renders one digitally reconstructed radiograph. Pixels of an .mha are line integrals (1/mm times mm); a "
      ".png goes from the darkest to the brightest of them.",
      "render");
  auto* ct = app.add_option("--ct", arguments.ct.path, "CT: NIfTI, NRRD, MetaImage or a DICOM folder")
                 ->check(CLI::ExistingPath);
  auto* phantom = app.add_option("--phantom", arguments.ct.phantom, "one of the project's phantoms instead of a CT")
                      ->check(CLI::IsMember({"head", "pelvis", "cube"}));
  ct->excludes(phantom);
  app.add_option("--spacing", arguments.ct.spacing_mm, "voxels of the phantom, mm")->capture_default_str();
  app.add_option("--camera", arguments.camera, "camera, YAML (docs/formats.md)")->required()->check(CLI::ExistingFile);
  app.add_option("--pose", arguments.pose, "pose of the CT in the camera, YAML (docs/formats.md)")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--output", arguments.output, "drr.png or drr.mha")->required();
  app.add_option("--method", arguments.method, "who renders: fast or paper on the device, exact on the host")
      ->check(CLI::IsMember({"fast", "paper", "exact"}))
      ->capture_default_str();
  app.add_option("--device", arguments.device, "auto, gpu, cpu, or a part of the device's name")->capture_default_str();
  app.add_option("--water-attenuation", arguments.attenuation.water_per_mm, "of water, 1/mm")->capture_default_str();
  app.add_option("--threshold-hu", arguments.attenuation.threshold_hu, "below it counts as air")->capture_default_str();
  addCtReadOptions(app, &arguments.ct.read);
  app.add_flag("--verbose", arguments.verbose, "say what is done");
  return runTool(app, argc, argv, [&] {
    if (arguments.ct.path.empty() && arguments.ct.phantom.empty()) throw ArgumentError("--ct or --phantom is required");
    run(arguments);
  });
}

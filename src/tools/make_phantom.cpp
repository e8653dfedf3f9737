// Writes one of the project's phantoms as a CT file.
#include "tools/common/command_line.h"
#include "tools/common/ct_source.h"
#include "xray_registration/volume/volume_io.h"

int main(int argc, char** argv) {
  using namespace xray_registration;
  using namespace xray_registration::tools;
  CtSource source;
  std::string output;
  CLI::App app("Writes one of the project's phantoms as a CT in Hounsfield units.", "make_phantom");
  app.add_option("--phantom", source.phantom, "head, pelvis or cube")
      ->required()
      ->check(CLI::IsMember({"head", "pelvis", "cube"}));
  app.add_option("--spacing", source.spacing_mm, "voxel size, mm")->capture_default_str();
  app.add_option("--output", output, "CT file: .nii, .nii.gz, .nrrd or .mha")->required();
  return runTool(app, argc, argv, [&] {
    requireWritableParent(output, "--output");
    writeVolume(loadCt(source, {}), output);
  });
}

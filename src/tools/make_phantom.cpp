// Writes one of the project's phantoms as a CT file, and its bones as a label image.
#include <cstdio>

#include "tools/common/command_line.h"
#include "tools/common/ct_source.h"
#include "xray_registration/volume/volume_io.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

void writeLabelled(const LabelledPhantom& phantom, const std::string& output, const std::string& labels_output) {
  writeVolume(phantom.ct, output);
  Volume labels;
  labels.grid = phantom.labels.grid;
  labels.name = phantom.ct.name;
  labels.hu.assign(phantom.labels.labels.begin(), phantom.labels.labels.end());
  writeVolume(labels, labels_output);
  for (const auto& [name, label] : phantom.names) std::printf("%s:%d\n", name.c_str(), label);
}

}  // namespace

int main(int argc, char** argv) {
  CtSource source;
  std::string output;
  std::string labels;
  CLI::App app("Writes one of the project's phantoms as a CT in Hounsfield units.", "make_phantom");
  app.add_option("--phantom", source.phantom, "head, pelvis or cube")
      ->required()
      ->check(CLI::IsMember({"head", "pelvis", "cube"}));
  app.add_option("--spacing", source.spacing_mm, "voxel size, mm")->capture_default_str();
  app.add_option("--output", output, "CT file: .nii, .nii.gz, .nrrd or .mha")->required();
  app.add_option("--labels", labels, "label image of the bones of head or pelvis; their NAME:LABEL are printed");
  return runTool(app, argc, argv, [&] {
    requireWritableParent(output, "--output");
    if (labels.empty()) {
      writeVolume(loadCt(source, {}), output);
    } else {
      requireWritableParent(labels, "--labels");
      writeLabelled(loadLabelledPhantom(source), output, labels);
    }
  });
}

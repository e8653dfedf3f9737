#include "xray_registration/pipeline/parameters.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "pipeline/body_parser.h"
#include "pipeline/parameter_group.h"
#include "xray_registration/common/names.h"
#include "xray_registration/common/yaml_file.h"
#include "xray_registration/pipeline/pose_yaml.h"

namespace xray_registration {

namespace {

/// How the CTs' numbers and lengths are to be understood.
void readCtValues(ParameterGroup* group, VolumeReadOptions* read) {
  group->number("hu_slope", -1e9, 1e9, &read->hu_slope);
  if (read->hu_slope == 0.0) group->fail("hu_slope", "0", "a number other than 0");
  group->number("hu_intercept", -1e9, 1e9, &read->hu_intercept);
  std::string padding;
  group->words("padding", &padding);
  if (!padding.empty()) {
    read->padding = 0.0;
    group->number("padding", -1e300, 1e300, &*read->padding);
  }
  group->flag("check_values", &read->check_values);
  group->words("orientation", &read->orientation);
  if (!read->orientation.empty() && !isOrientation(read->orientation)) {
    group->fail("orientation", read->orientation, "three letters such as RAS or LPS, or nothing");
  }
  group->number("unit_mm", 0.0, 1e6, &read->unit_mm);
}

void readCt(const YAML::Node& tree, CtParameters* ct, SetupSigmas* sigmas) {
  ParameterGroup group(tree, "ct");
  group.words("path", &ct->path);
  group.words("series_uid", &ct->read.series_uid);
  group.words("directory", &ct->read.directory);
  readCtValues(&group, &ct->read);
  group.number("water_attenuation", 1e-4, 1.0, &ct->model.water_per_mm);
  group.number("threshold_hu", -1024.0, 3000.0, &ct->model.threshold_hu);
  group.words("mask", &ct->mask);
  group.integer("label", 1, 65535, &ct->label);
  group.flag("rest", &ct->rest);
  group.number("surface_threshold_hu", -1024.0, 3000.0, &ct->surface_threshold_hu);
  group.integer("surface_triangles", 0, 2000000, &ct->surface_triangles);
  group.number("scale_sigma", 0.0, 0.5, &sigmas->ct_scale);
  group.refuseUnknown();
}

/// image/<name>/<view>: a file for one view.
void readPerView(const YAML::Node& image_tree, const std::string& name, const std::vector<std::string>& views,
                 std::map<std::string, std::string>* files) {
  ParameterGroup per_view(image_tree, name, "image/");
  for (const std::string& view : views) per_view.words(view, &(*files)[view]);
  per_view.refuseUnknown();
}

void readImage(const YAML::Node& tree, const std::vector<std::string>& views, ImageParameters* image) {
  ParameterGroup group(tree, "image");
  group.choice<ImageKind>("kind",
                          {{"transmission", ImageKind::kTransmission},
                           {"attenuation", ImageKind::kAttenuation},
                           {"inverted", ImageKind::kInverted}},
                          &image->linearize.kind);
  group.number("open_field", 0.0, 1e12, &image->linearize.open_field);
  group.number("max_value", 0.0, 1e12, &image->max_value);
  group.flag("find_collimator", &image->find.collimator);
  group.flag("find_letters", &image->find.letters);
  group.flag("find_metal", &image->find.metal);
  group.words("mask", &image->mask);
  group.words("undistortion_map", &image->undistortion_map);
  const bool masks = ParameterGroup::isGiven(group.known("masks"));
  const bool maps = ParameterGroup::isGiven(group.known("undistortion_maps"));
  group.refuseUnknown();
  if (masks) readPerView(tree["image"], "masks", views, &image->masks);
  if (maps) readPerView(tree["image"], "undistortion_maps", views, &image->undistortion_maps);
}

void readFrames(const YAML::Node& tree, FrameParameters* frames) {
  ParameterGroup group(tree, "frames");
  group.words("ct", &frames->ct);
  group.words("fixed", &frames->fixed);
  group.number("tf_timeout", 0.0, 5.0, &frames->tf_timeout_s);
  group.flag("allow_change", &frames->allow_change);
  group.refuseUnknown();
}

void readSync(const YAML::Node& tree, SyncParameters* sync) {
  ParameterGroup group(tree, "sync");
  group.number("tolerance", 0.0, 10.0, &sync->tolerance_s);
  group.number("patience", 0.01, 10.0, &sync->patience_s);
  group.flag("allow_missing_view", &sync->allow_missing_view);
  group.refuseUnknown();
}

void readStamps(const YAML::Node& tree, StampParameters* stamps) {
  ParameterGroup group(tree, "stamps");
  group.number("max_ahead", 0.0, 60.0, &stamps->max_ahead_s);
  group.number("max_jump", 0.0, 3600.0, &stamps->max_jump_s);
  group.number("max_late", 0.1, 3600.0, &stamps->max_late_s);
  group.integer("frames_until_new", 2, 1000, &stamps->frames_until_new);
  group.refuseUnknown();
}

void readHealth(const YAML::Node& tree, HealthParameters* health) {
  ParameterGroup group(tree, "health");
  group.number("hold_timeout", 0.0, 3600.0, &health->hold_timeout_s);
  group.number("image_age_warn", 0.01, 1e6, &health->image_age_warn_s);
  group.number("image_age_error", 0.01, 1e6, &health->image_age_error_s);
  group.number("pose_age_warn", 0.01, 1e6, &health->pose_age_warn_s);
  group.number("pose_age_error", 0.01, 1e6, &health->pose_age_error_s);
  group.number("min_rate", 0.0, 1000.0, &health->min_rate_hz);
  group.number("max_dropped", 0.0, 1.0, &health->max_dropped);
  group.refuseUnknown();
}

void readAccept(const YAML::Node& tree, AcceptOptions* accept) {
  ParameterGroup group(tree, "accept");
  group.number("min_similarity", -1.0, 1.0, &accept->min_similarity);
  group.number("min_similarity_one_view", -1.0, 1.0, &accept->min_similarity_one_view);
  group.number("sure_similarity", -1.0, 1.0, &accept->sure_similarity);
  group.number("min_inlier_fraction", 0.0, 1.0, &accept->min_inlier_fraction);
  group.number("min_inlier_fraction_one_view", 0.0, 1.0, &accept->min_inlier_fraction_one_view);
  group.number("alone_similarity", -1.0, 1.0, &accept->alone_similarity);
  group.number("alone_similarity_one_view", -1.0, 1.0, &accept->alone_similarity_one_view);
  group.number("alone_inlier_fraction", 0.0, 1.0, &accept->alone_inlier_fraction);
  group.number("alone_inlier_fraction_one_view", 0.0, 1.0, &accept->alone_inlier_fraction_one_view);
  group.number("max_condition_number", 1.0, 1e15, &accept->max_condition_number);
  group.number("max_jump_mm", 0.1, 1000.0, &accept->max_jump_mm);
  group.number("max_jump_rad", 1e-3, M_PI, &accept->max_jump_rad);
  group.number("max_disagreement_mm", 0.01, 100.0, &accept->max_disagreement_mm);
  group.number("min_margin", 0.0, 2.0, &accept->min_margin);
  group.number("clear_margin", 0.0, 3.0, &accept->clear_margin);
  group.number("max_setup_error_mm", 0.01, 1000.0, &accept->max_setup_error_mm);
  group.number("max_residual_motion_mm", 0.01, 1000.0, &accept->max_residual_motion_mm);
  group.number("body_min_similarity", -1.0, 1.0, &accept->body.min_similarity);
  group.number("body_min_inlier_fraction", 0.0, 1.0, &accept->body.min_inlier_fraction);
  group.number("body_min_margin", 0.0, 2.0, &accept->body.min_margin);
  group.number("body_max_overlap_mm3", 0.0, 1e9, &accept->body.max_overlap_mm3);
  group.refuseUnknown();
}

void readSolver(const YAML::Node& tree, RegistrarOptions* solver) {
  ParameterGroup group(tree, "solver");
  std::vector<std::pair<std::string, Similarity>> similarities;
  for (const SimilarityKind& kind : kSimilarities) similarities.emplace_back(kind.name, kind.similarity);
  group.choice<Similarity>("similarity", similarities, &solver->similarity);
  group.integer("max_steps_per_frame", 1, 10000, &solver->max_steps_per_frame);
  group.number("max_image_pixels", 1024.0, 67108864.0, &solver->max_image_pixels);
  group.number("tracking_precision_mm", 0.0, 10.0, &solver->tracking_precision_mm);
  group.flag("search", &solver->search);
  group.number("search_rotation_rad", 0.0, M_PI, &solver->search_rotation_rad);
  group.number("search_translation_mm", 0.0, 500.0, &solver->search_translation_mm);
  group.integer("search_poses", 1, 100000, &solver->search_poses);
  group.flag("robust_weights", &solver->robust_weights);
  group.flag("truncation_weights", &solver->truncation_weights);
  group.integer("check_every", 0, 1000000, &solver->check_every);
  group.integer("paper_max_iterations", 1, 1000, &solver->paper_max_iterations);
  group.number("paper_stop_norm", 1e-6, 100.0, &solver->paper_stop_norm);
  group.number("paper_step_deg", 1e-4, 20.0, &solver->paper_step_deg);
  group.number("paper_step_mm", 1e-4, 50.0, &solver->paper_step_mm);
  group.integer("paper_image_size", 16, 4096, &solver->paper_image_size);
  group.refuseUnknown();
}

void readGeometry(const YAML::Node& tree, SetupSigmas* sigmas) {
  ParameterGroup group(tree, "geometry");
  group.number("focal_length_sigma", 0.0, 0.5, &sigmas->focal_length);
  group.number("principal_point_sigma_px", 0.0, 1000.0, &sigmas->principal_point_px);
  group.number("view_rotation_sigma_deg", 0.0, 45.0, &sigmas->view_rotation_deg);
  group.number("view_translation_sigma_mm", 0.0, 500.0, &sigmas->view_translation_mm);
  group.refuseUnknown();
}

void readLocalize(const YAML::Node& tree, LocalizeParameters* localize) {
  ParameterGroup group(tree, "localize");
  group.number("nearest_mm", 10.0, 1e4, &localize->nearest_mm);
  group.number("farthest_mm", 10.0, 1e4, &localize->farthest_mm);
  group.words("centre_frame", &localize->centre_frame);
  group.number("centre_range_mm", 1.0, 1e4, &localize->centre_range_mm);
  group.refuseUnknown();
  if (localize->farthest_mm < localize->nearest_mm) {
    group.fail("farthest_mm", std::to_string(localize->farthest_mm), "not less than localize/nearest_mm");
  }
}

void readTracking(const YAML::Node& tree, TrackerOptions* tracker, Recover* recover) {
  ParameterGroup group(tree, "tracking");
  group.integer("frames_until_lost", 1, 100000, &tracker->frames_until_lost);
  group.number("max_prediction_gap_s", 0.0, 3600.0, &tracker->max_prediction_gap_s);
  group.number("max_velocity_mm_s", 0.0, 1e5, &tracker->max_velocity_mm_s);
  group.number("max_velocity_rad_s", 0.0, 1e3, &tracker->max_velocity_rad_s);
  group.choice<Recover>("recover", {{"off", Recover::kOff}, {"local", Recover::kLocal}, {"wide", Recover::kWide}},
                        recover);
  group.refuseUnknown();
}

void readInitialPose(const YAML::Node& tree, NodeParameters* parameters) {
  const YAML::Node node = ParameterGroup(tree, "").known("initial_pose");
  // "none" is how a launch file or a person writes that there is none.
  if (!ParameterGroup::isGiven(node) || (node.IsScalar() && (node.Scalar().empty() || node.Scalar() == "none"))) return;
  try {
    parameters->initial_pose = poseFromYaml(node);
  } catch (const std::invalid_argument& error) {
    throw ParameterError("parameter initial_pose is '" + shown(node) + "': " + error.what() +
                         "; allowed: " + kPoseInYaml);
  }
  ParameterGroup group(tree, "initial_pose");
  for (const char* key : {"position", "orientation", "T_camera_ct_mm"}) group.known(key);
  group.words("frame_id", &parameters->initial_pose_frame);
  group.refuseUnknown();
}

void readCalibration(const YAML::Node& tree, int* frames) {
  ParameterGroup group(tree, "calibration");
  group.integer("frames", 0, 100, frames);
  group.refuseUnknown();
}

void readClicks(const YAML::Node& tree, ClickParameters* clicks) {
  ParameterGroup group(tree, "clicks");
  group.words("point_topic", &clicks->point_topic);
  group.words("pixel_suffix", &clicks->pixel_suffix);
  if (!isNamePath(clicks->point_topic)) {
    group.fail("point_topic", clicks->point_topic, "the name of a topic");
  }
  if (clicks->pixel_suffix.empty() || !isNamePath("image" + clicks->pixel_suffix)) {
    group.fail("pixel_suffix", clicks->pixel_suffix, "letters, digits, _ and /");
  }
  group.refuseUnknown();
}

void checkViews(const std::vector<std::string>& views) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    // A name that ROS does not take would only fail when subscribing.
    if (!isNamePath(views[i])) {
      throw ParameterError("parameter views has '" + views[i] +
                           "'; allowed: names of topics: a letter, then letters, digits, _ and /");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (views[i] == views[j])
        throw ParameterError("parameter views has '" + views[i] + "' twice; allowed: each once");
    }
  }
}

void readTop(const YAML::Node& tree, NodeParameters* parameters, const Logger& logger) {
  ParameterGroup top(tree, "");
  top.list("views", &parameters->views);
  checkViews(parameters->views);
  top.words("device", &parameters->device);
  top.choice<Method>("method", {{"fast", Method::kFast}, {"paper", Method::kPaper}}, &parameters->registrar.method);
  top.choice<Mode>("mode", {{"track", Mode::kTrack}, {"on_demand", Mode::kOnDemand}}, &parameters->mode);
  top.choice<std::string>("drr_encoding", {{"mono8", "mono8"}, {"32FC1", "32FC1"}}, &parameters->drr_encoding);
  top.words("image_transport", &parameters->image_transport);
  top.flag("publish_tf", &parameters->frames.publish_tf);
  top.flag("invert_tf", &parameters->frames.invert_tf);
  readInitialPose(tree, parameters);
  for (const char* group : {"initial_pose", "ct", "image", "frames", "sync", "stamps", "health", "accept", "solver",
                            "tracking", "geometry", "calibration", "bodies", "localize", "clicks", "diagnostic_period"})
    top.known(group);
  for (const auto& [name, value] : top.unknown()) {
    log(logger, LogLevel::kWarning, "parameter " + name + " is not known and has no effect");
  }
}

}  // namespace

bool NodeParameters::needsCt() const {
  return bodies.empty() ||
         std::any_of(bodies.begin(), bodies.end(), [](const BodyParameters& body) { return body.isCutFromCt(); });
}

NodeParameters parseParameters(const YAML::Node& tree, const Logger& logger) {
  NodeParameters parameters;
  readTop(tree, &parameters, logger);
  readCt(tree, &parameters.ct, &parameters.registrar.setup);
  readImage(tree, parameters.views, &parameters.image);
  readFrames(tree, &parameters.frames);
  readSync(tree, &parameters.sync);
  readStamps(tree, &parameters.stamps);
  readHealth(tree, &parameters.health);
  readAccept(tree, &parameters.registrar.accept);
  readSolver(tree, &parameters.registrar);
  readGeometry(tree, &parameters.registrar.setup);
  readTracking(tree, &parameters.tracker, &parameters.recover);
  readLocalize(tree, &parameters.localize);
  readCalibration(tree, &parameters.calibration_frames);
  readClicks(tree, &parameters.clicks);
  parameters.bodies = readBodies(tree, logger);
  validate(parameters);
  return parameters;
}

NodeParameters loadParametersYaml(const std::string& path, const Logger& logger) {
  YAML::Node tree;
  try {
    tree = loadYaml(path);
  } catch (const std::runtime_error& error) {
    throw ParameterError("cannot read parameters from '" + path + "': it " + error.what());
  }
  try {
    if (tree.IsNull()) return NodeParameters{};
    if (!tree.IsMap()) throw ParameterError("the file does not hold names and values");
    return parseParameters(tree, logger);
  } catch (const ParameterError& error) {
    throw ParameterError(path + ": " + error.what());
  }
}

namespace {

void checkOrder(const std::string& name, double warn_s, double error_s) {
  if (warn_s <= error_s) return;
  std::ostringstream message;
  message << "parameter health/" << name << "_warn is '" << warn_s << "'; allowed: no more than health/" << name
          << "_error, which is '" << error_s << "'";
  throw ParameterError(message.str());
}

}  // namespace

void validate(const NodeParameters& parameters) {
  checkOrder("image_age", parameters.health.image_age_warn_s, parameters.health.image_age_error_s);
  checkOrder("pose_age", parameters.health.pose_age_warn_s, parameters.health.pose_age_error_s);
  const auto check_frame = [](const char* name, const std::string& frame) {
    if (!frame.empty() && (frame.front() == '/' || frame.find(' ') != std::string::npos)) {
      throw ParameterError(std::string("parameter ") + name + " is '" + frame +
                           "'; allowed: a tf2 frame, without a leading / and spaces");
    }
  };
  check_frame("frames/ct", parameters.frames.ct);
  check_frame("frames/fixed", parameters.frames.fixed);
  check_frame("initial_pose/frame_id", parameters.initial_pose_frame);
  if (parameters.frames.ct.empty()) throw ParameterError("parameter frames/ct is empty; allowed: a tf2 frame");
  if (parameters.frames.ct == parameters.frames.fixed) {
    throw ParameterError("parameters frames/ct and frames/fixed are both '" + parameters.frames.ct +
                         "'; allowed: two different frames");
  }
  if (parameters.initial_pose_frame == parameters.frames.ct) {
    throw ParameterError(
        "parameter initial_pose/frame_id is '" + parameters.initial_pose_frame +
        "', the CT's own frame (frames/ct); allowed: the X-ray's optical frame, or one that tf connects");
  }
  if (parameters.device.empty()) {
    throw ParameterError("parameter device is ''; allowed: auto, gpu, cpu, or a part of the device's name");
  }
  validateBodies(parameters);
}

}  // namespace xray_registration

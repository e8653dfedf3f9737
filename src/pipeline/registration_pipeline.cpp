#include "xray_registration/pipeline/registration_pipeline.h"

#include <algorithm>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "xray_registration/common/stopwatch.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/registration/registrar_factory.h"

namespace xray_registration {

namespace {

MaskImage readMask(const std::string& path, const std::string& parameter) {
  const cv::Mat mask = cv::imread(path, cv::IMREAD_GRAYSCALE);
  if (mask.empty()) {
    throw ParameterError("parameter " + parameter + " is '" + path +
                         "', which cannot be read; allowed: an 8-bit PNG or PGM image, non-zero = use");
  }
  MaskImage result(mask.cols, mask.rows);
  for (int v = 0; v < mask.rows; ++v) std::copy_n(mask.ptr<std::uint8_t>(v), mask.cols, &result.at(0, v));
  return result;
}

std::string viewInWords(const std::string& view) { return view.empty() ? "the view" : "view '" + view + "'"; }

/// Lets a frame go on without its first view: the registrar sees the first view that is there as the first, the caller
/// keeps the pose in the camera frame of the first one of all.
class RebasedRegistrar : public Registrar {
 public:
  explicit RebasedRegistrar(Registrar* registrar) : registrar_(registrar) {}

  void setVolume(const AttenuationVolume& volume) override { registrar_->setVolume(volume); }
  bool hasVolume() const override { return registrar_->hasVolume(); }
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) override {
    return registrar_->renderDrr(camera, T_camera_ct);
  }
  Eigen::Vector3d centreCt() const override { return registrar_->centreCt(); }
  std::string deviceName() const override { return registrar_->deviceName(); }
  std::size_t deviceBytes() const override { return registrar_->deviceBytes(); }

  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& T_first_ct_start,
                                   bool tracking) override {
    const RigidTransform T_base_first = views.front().T_view_first;
    if (T_base_first.isApprox(RigidTransform::Identity(), 0.0)) {
      return registrar_->registerFrame(views, T_first_ct_start, tracking);
    }
    const RigidTransform T_first_base = T_base_first.inverse();
    std::vector<ViewInput> rebased = views;
    for (ViewInput& view : rebased) view.T_view_first = view.T_view_first * T_first_base;
    rebased.front().T_view_first = RigidTransform::Identity();
    RegistrationResult result = registrar_->registerFrame(rebased, T_base_first * T_first_ct_start, tracking);
    result.T_camera_ct = T_first_base * result.T_camera_ct;
    const Matrix6d turn = twistCarriedBy(T_first_base);
    result.covariance = turn * result.covariance * turn.transpose();
    return result;
  }

 private:
  Registrar* registrar_;
};

}  // namespace

RegistrationPipeline::RegistrationPipeline(NodeParameters parameters, Logger logger)
    : parameters_(std::move(parameters)), logger_(std::move(logger)), tracker_(parameters_.tracker) {
  factory_ = [this](const RegistrarOptions& options) { return registrarFromDevice(options); };
  loadMasks();
}

RegistrationPipeline::RegistrationPipeline(NodeParameters parameters, RegistrarFactory factory, Logger logger)
    : parameters_(std::move(parameters)),
      logger_(std::move(logger)),
      factory_(std::move(factory)),
      tracker_(parameters_.tracker) {
  loadMasks();
}

RegistrationPipeline::~RegistrationPipeline() = default;

std::unique_ptr<Registrar> RegistrationPipeline::registrarFromDevice(const RegistrarOptions& options) {
  if (!device_) device_ = std::make_shared<Device>(parameters_.device, logger_);
  return makeRegistrar(device_, options, logger_);
}

void RegistrationPipeline::loadMasks() {
  for (const std::string& view : parameters_.viewNames()) {
    const auto own = parameters_.image.masks.find(view);
    const bool has_own = own != parameters_.image.masks.end() && !own->second.empty();
    const std::string& path = has_own ? own->second : parameters_.image.mask;
    if (!path.empty()) masks_[view] = readMask(path, has_own ? "image/masks/" + view : "image/mask");
  }
}

void RegistrationPipeline::openDevice() {
  if (registrar_) return;
  try {
    registrar_ = factory_(parameters_.registrar);
    fault_.clear();
  } catch (const DeviceError& error) {
    device_.reset();
    fault_ = error.what();
    throw;
  }
}

void RegistrationPipeline::upload() {
  try {
    openDevice();
    registrar_->setVolume(*attenuation_);
  } catch (const DeviceError& error) {
    fault_ = error.what();
    registrar_.reset();
    device_.reset();
    throw;
  }
  fault_.clear();
  centre_ct_ = registrar_->centreCt();
}

void RegistrationPipeline::loadCt(const std::string& path, const std::string& series_uid) {
  VolumeReadOptions options = parameters_.ct.read;
  if (!series_uid.empty()) options.series_uid = series_uid;
  setCt(readVolume(path, options, logger_));
}

void RegistrationPipeline::setCt(const Volume& ct) {
  const CtParameters& parameters = parameters_.ct;
  auto attenuation = std::make_shared<AttenuationVolume>(
      parameters.mask.empty() ? toAttenuation(ct, parameters.model)
                              : toAttenuation(ct, parameters.model,
                                              readLabels(parameters.mask, parameters.read, logger_), parameters.label));
  // From here on the new CT counts, also when the device refuses it: an old one must not go on being registered.
  attenuation_ = std::move(attenuation);
  ct_ = std::make_shared<Volume>(ct);
  ct_name_ = ct.name;
  tracker_.reset();
  last_accepted_s_.reset();
  rebuilt_since_success_ = false;
  upload();
}

void RegistrationPipeline::setPose(const RigidTransform& T_camera_ct) {
  tracker_.setPose(T_camera_ct);
  last_accepted_s_.reset();
}

void RegistrationPipeline::reset() {
  tracker_.reset();
  last_accepted_s_.reset();
  if (fault_.empty()) return;
  fault_.clear();
  rebuilt_since_success_ = false;
  registrar_.reset();
  device_.reset();
}

ViewInput RegistrationPipeline::makeView(const RawView& raw) const {
  if (!raw.image) throw FrameError(raw.problem.empty() ? "no image" : raw.problem);
  const ImageParameters& options = parameters_.image;
  double saturation = options.max_value > 0.0 ? options.max_value : raw.image->saturation;
  const bool unbounded = saturation >= static_cast<double>(std::numeric_limits<float>::max());
  if (unbounded && options.linearize.kind == ImageKind::kInverted && !raw.image->pixels.empty()) {
    // An inverted image in floats has no largest value but its own.
    saturation = *std::max_element(raw.image->pixels.pixels.begin(), raw.image->pixels.pixels.end());
  }
  XrayFrame frame = makeXrayFrame(raw.image->pixels, saturation, raw.calibration, options.linearize, &maps_[raw.name]);
  const auto mask = masks_.find(raw.name);
  const MaskImage user = mask == masks_.end() ? MaskImage{} : mask->second;
  if (!user.empty() && (user.width != frame.attenuation.width || user.height != frame.attenuation.height)) {
    throw FrameError("the image is " + std::to_string(frame.attenuation.width) + "x" +
                     std::to_string(frame.attenuation.height) + " but its mask (image/mask) is " +
                     std::to_string(user.width) + "x" + std::to_string(user.height));
  }
  maskFrame(&frame, options.find, user);
  return ViewInput(std::make_shared<const XrayFrame>(std::move(frame)), raw.T_view_first);
}

TrackingState RegistrationPipeline::state() const {
  if (!fault_.empty()) return TrackingState::kFault;
  if (!hasCt()) return TrackingState::kWaitingForCt;
  return tracker_.state();
}

FrameOutcome RegistrationPipeline::refused(const std::string& reason) const {
  FrameOutcome outcome;
  outcome.result.reason = reason;
  outcome.state = state();
  return outcome;
}

PreparedFrame RegistrationPipeline::prepare(const std::vector<RawView>& views) const {
  const Stopwatch watch;
  PreparedFrame frame;
  frame.views.resize(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    try {
      frame.views[i] = makeView(views[i]);
    } catch (const std::exception& error) {
      if (!frame.problem.empty()) frame.problem += "; ";
      if (!views[i].name.empty()) frame.problem += viewInWords(views[i].name) + ": ";
      frame.problem += error.what();
    }
  }
  frame.prepare_ms = watch.milliseconds();
  return frame;
}

FrameOutcome RegistrationPipeline::process(double stamp_s, const std::vector<RawView>& views,
                                           const std::optional<RigidTransform>& T_camera_now_camera_last) {
  if (!fault_.empty()) return refused(fault_);
  if (!hasCt()) return refused("no CT is loaded");
  return process(stamp_s, prepare(views), T_camera_now_camera_last);
}

FrameOutcome RegistrationPipeline::process(double stamp_s, PreparedFrame frame,
                                           const std::optional<RigidTransform>& T_camera_now_camera_last) {
  const bool some =
      std::any_of(frame.views.begin(), frame.views.end(), [](const auto& view) { return view.has_value(); });
  FrameOutcome outcome;
  if (!fault_.empty() || !hasCt() || frame.problem.empty() || (some && parameters_.sync.allow_missing_view)) {
    outcome = process(stamp_s, frame.views, T_camera_now_camera_last);
    if (!outcome.result.accepted && !frame.problem.empty()) outcome.result.reason += " (" + frame.problem + ")";
  } else {
    outcome = refused(frame.problem);
    const std::vector<std::string> names = parameters_.viewNames();
    for (std::size_t i = 0; i < frame.views.size(); ++i) {
      if (!frame.views[i]) outcome.views_missing.push_back(i < names.size() ? names[i] : std::to_string(i));
    }
    outcome.views = std::move(frame.views);
  }
  outcome.prepare_ms = frame.prepare_ms;
  outcome.total_ms += frame.prepare_ms;
  return outcome;
}

FrameOutcome RegistrationPipeline::process(double stamp_s, const std::vector<std::optional<ViewInput>>& views,
                                           const std::optional<RigidTransform>& T_camera_now_camera_last) {
  const Stopwatch watch;
  if (!fault_.empty()) return refused(fault_);
  if (!hasCt()) return refused("no CT is loaded");
  const std::vector<std::string> names = parameters_.viewNames();
  FrameOutcome outcome;
  std::vector<ViewInput> present;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string name = i < names.size() ? names[i] : std::to_string(i);
    (views[i] ? outcome.views_used : outcome.views_missing).push_back(name);
    if (views[i]) present.push_back(*views[i]);
  }
  outcome.views = views;
  if (present.empty()) {
    outcome.result.reason = "no view of this frame can be used";
  } else if (!outcome.views_missing.empty() && !parameters_.sync.allow_missing_view) {
    outcome.result.reason =
        viewInWords(outcome.views_missing.front()) + " is missing (sync/allow_missing_view is false)";
  } else {
    registerViews(stamp_s, present, T_camera_now_camera_last, &outcome);
  }
  outcome.state = state();
  outcome.total_ms = watch.milliseconds();
  return outcome;
}

void RegistrationPipeline::registerViews(double stamp_s, const std::vector<ViewInput>& present,
                                         const std::optional<RigidTransform>& T_camera_now_camera_last,
                                         FrameOutcome* outcome) {
  RegistrationResult& result = outcome->result;
  try {
    if (!registrar_) upload();  // After a reset that followed a fault.
    if (!tracker_.prediction(stamp_s, T_camera_now_camera_last)) {
      result.reason = "no initial pose is known yet";
      return;
    }
    RebasedRegistrar rebased(registrar_.get());
    result = tracker_.process(&rebased, present, stamp_s, T_camera_now_camera_last);
    outcome->registered = true;
  } catch (const DeviceError& error) {
    result = RegistrationResult{};
    result.reason = std::string("the device failed: ") + error.what();
    if (rebuildAfter(error.what())) result.reason += " (it was opened anew)";
    return;
  } catch (const std::exception& error) {
    result = RegistrationResult{};
    result.reason = std::string("the registration failed: ") + error.what();
    return;
  }
  if (!result.T_camera_ct.matrix().allFinite()) {
    // Registrars promise finite poses; a broken promise must not reach tf.
    result = RegistrationResult{};
    result.reason = "the registration gave a pose that is not finite";
    outcome->registered = false;
    return;
  }
  if (result.accepted) {
    last_accepted_s_ = stamp_s;
    rebuilt_since_success_ = false;
    result.reason.clear();
  } else if (result.reason.empty()) {
    result.reason = "the registration was not accepted";
  }
}

bool RegistrationPipeline::rebuildAfter(const std::string& failure) {
  registrar_.reset();
  device_.reset();
  if (rebuilt_since_success_) {
    fault_ = failure;
    log(logger_, LogLevel::kError, "the device failed again: " + failure);
    return false;
  }
  rebuilt_since_success_ = true;
  log(logger_, LogLevel::kError, "the device failed and is opened anew: " + failure);
  try {
    upload();
    return true;
  } catch (const std::exception& error) {
    fault_ = failure + "; opening the device anew failed: " + error.what();
    log(logger_, LogLevel::kError, fault_);
    return false;
  }
}

FloatImage RegistrationPipeline::renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  if (!registrar_ || !hasCt() || !fault_.empty()) return {};
  try {
    return registrar_->renderDrr(camera, T_camera_ct);
  } catch (const DeviceError& error) {
    rebuildAfter(error.what());
    return {};
  }
}

void RegistrationPipeline::setTuning(const RegistrarOptions& registrar, const TrackerOptions& tracker) {
  const Method method = parameters_.registrar.method;
  parameters_.registrar = registrar;
  parameters_.registrar.method = method;
  parameters_.tracker = tracker;
  tracker_.setOptions(tracker);
  if (!registrar_ || registrar_->setOptions(parameters_.registrar)) return;
  registrar_.reset();
  if (!hasCt()) return;
  try {
    upload();
  } catch (const DeviceError& error) {
    log(logger_, LogLevel::kError, std::string("the device failed after a change of parameters: ") + error.what());
  }
}

std::string RegistrationPipeline::deviceName() const { return registrar_ ? registrar_->deviceName() : ""; }

std::size_t RegistrationPipeline::deviceBytes() const { return registrar_ ? registrar_->deviceBytes() : 0; }

}  // namespace xray_registration

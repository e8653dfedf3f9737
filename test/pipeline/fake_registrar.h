#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "xray_registration/drr/device.h"
#include "xray_registration/pipeline/frame_maker.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// What the fake registrars of one test share: what they are to do, and what was asked of them.
struct Script {
  int failures_to_make = 0;
  int failures_to_register = 0;
  int failures_to_render = 0;
  bool accepts = true;
  bool solves = true;
  bool gives_nan = false;
  bool takes_options = true;
  std::function<void()> on_set_volume;  ///< May throw; the old volume is gone by then.

  int search_slices = 3;                      ///< Of a wide search; less than 0: it knows none.
  int failures_to_search = 0;                 ///< Slices that the device fails at.
  std::vector<RigidTransform> places;         ///< That a wide search finds.
  std::optional<WideSearchRange> last_range;  ///< Of a wide search.
  int searches_alive = 0;
  std::vector<RigidTransform> last_places;  ///< That a frame was registered among.

  std::vector<bool> accepts_bodies;          ///< One for each body; more are accepted.
  std::function<void(BodyResult*)> on_body;  ///< Changes what a body's result would be.
  std::vector<BodyStart> last_body_starts;

  int made = 0;
  int alive = 0;
  int volumes = 0;
  int forgotten = 0;
  std::vector<ViewInput> last_views;
  RigidTransform last_start = RigidTransform::Identity();
  bool last_tracking = false;
  bool last_was_empty = false;  ///< The registrar that registered last had registered nothing before.
};

/// Slices that do nothing.
class FakeSearch : public WideSearch {
 public:
  explicit FakeSearch(Script* script) : script_(script) { ++script_->searches_alive; }
  ~FakeSearch() override { --script_->searches_alive; }
  FakeSearch(const FakeSearch&) = delete;
  FakeSearch& operator=(const FakeSearch&) = delete;

  bool advance() override {
    if (script_->failures_to_search > 0) {
      --script_->failures_to_search;
      throw DeviceError("device lost", -5);
    }
    return ++done_ < script_->search_slices;
  }
  double progress() const override { return done_ / static_cast<double>(script_->search_slices); }
  double bestSimilarity() const override { return 0.5; }
  const std::vector<RigidTransform>& places() const override { return script_->places; }

 private:
  Script* script_;
  int done_ = 0;
};

/// Does what the script says. Like a real one it must not be asked for anything without a volume: it throws what no
/// caller expects.
class FakeRegistrar : public Registrar {
 public:
  explicit FakeRegistrar(Script* script) : script_(script) {
    ++script_->made;
    if (script_->failures_to_make > 0) {
      --script_->failures_to_make;
      throw DeviceError("no device of that name", -1);
    }
    ++script_->alive;
  }
  ~FakeRegistrar() override { --script_->alive; }
  FakeRegistrar(const FakeRegistrar&) = delete;
  FakeRegistrar& operator=(const FakeRegistrar&) = delete;

  void setVolume(const AttenuationVolume&) override {
    has_volume_ = false;
    if (script_->on_set_volume) script_->on_set_volume();
    has_volume_ = true;
    ++script_->volumes;
  }
  bool hasVolume() const override { return has_volume_; }
  void setBodies(const AttenuationVolume&, const std::vector<BodyModel>& bodies) override {
    needVolume();
    names_.clear();
    for (const BodyModel& body : bodies) names_.push_back(body.name);
  }
  /// Each where it was looked for.
  std::vector<BodyResult> registerBodies(const std::vector<BodyStart>& starts, RegistrationResult* rest) override {
    script_->last_body_starts = starts;
    std::vector<BodyResult> results(names_.size());
    for (std::size_t i = 0; i < results.size(); ++i) {
      results[i].name = names_[i];
      results[i].solved = true;
      results[i].accepted = i >= script_->accepts_bodies.size() || script_->accepts_bodies[i];
      if (!results[i].accepted) results[i].reason = names_[i] + " left the image";
      results[i].T_camera_body = rest->T_camera_ct * starts.at(i).T_ct_body;
      if (script_->on_body) script_->on_body(&results[i]);
    }
    return results;
  }
  /// Constant pictures: 1 is the rest, 10 the first body, 20 the second. renderDrr's are 0.
  std::vector<FloatImage> renderParts(const XrayCamera& camera, const RigidTransform&,
                                      const std::vector<RigidTransform>& T_camera_bodies) override {
    std::vector<FloatImage> parts = {FloatImage(camera.width, camera.height, 1.0F)};
    for (std::size_t i = 0; i < T_camera_bodies.size(); ++i) {
      parts.emplace_back(camera.width, camera.height, 10.0F * static_cast<float>(i + 1));
    }
    return parts;
  }

  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& start,
                                   bool tracking) override {
    needVolume();
    script_->last_views = views;
    script_->last_start = start;
    script_->last_tracking = tracking;
    script_->last_was_empty = is_empty_;
    if (script_->failures_to_register > 0) {
      --script_->failures_to_register;
      throw DeviceError("device lost", -5);
    }
    RegistrationResult result;
    result.solved = script_->solves;
    if (!result.solved) {
      result.reason = "the start is of no use";
      return result;
    }
    is_empty_ = false;
    result.accepted = script_->accepts;
    if (!result.accepted) result.reason = "the similarity is too low";
    result.T_camera_ct = start;
    if (script_->gives_nan) result.T_camera_ct.translation().x() = std::numeric_limits<double>::quiet_NaN();
    result.covariance.diagonal() << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
    return result;
  }
  RegistrationResult registerAmong(const std::vector<ViewInput>& views,
                                   const std::vector<RigidTransform>& places) override {
    script_->last_places = places;
    return registerFrame(views, places.front(), false);
  }
  std::unique_ptr<WideSearch> searchWidely(const std::vector<ViewInput>& views, const WideSearchRange& range) override {
    needVolume();
    script_->last_views = views;
    script_->last_range = range;
    return script_->search_slices < 0 ? nullptr : std::make_unique<FakeSearch>(script_);
  }
  void forget() override {
    is_empty_ = true;
    ++script_->forgotten;
  }
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform&) override {
    needVolume();
    if (script_->failures_to_render > 0) {
      --script_->failures_to_render;
      throw DeviceError("device lost", -5);
    }
    return FloatImage(camera.width, camera.height);
  }
  Eigen::Vector3d centreCt() const override {
    needVolume();
    return Eigen::Vector3d(1.0, 2.0, 3.0);
  }
  bool setOptions(const RegistrarOptions&) override { return script_->takes_options; }
  std::string deviceName() const override { return "fake"; }
  std::size_t deviceBytes() const override { return 1; }

 private:
  void needVolume() const {
    if (!has_volume_) throw std::logic_error("asked without a volume: a real registrar dereferences null here");
  }

  Script* script_;
  std::vector<std::string> names_;  ///< Of its bodies.
  bool has_volume_ = false;
  bool is_empty_ = true;
};

inline std::function<std::unique_ptr<Registrar>(const RegistrarOptions&)> fakes(Script* script) {
  return [script](const RegistrarOptions&) { return std::make_unique<FakeRegistrar>(script); };
}

/// A view that can be used.
inline RawView someView(const std::string& name = "") {
  RawView raw;
  raw.name = name;
  raw.image = RawImage{FloatImage(32, 24), 65535.0};
  for (std::size_t i = 0; i < raw.image->pixels.floats.pixels.size(); ++i) {
    raw.image->pixels.floats.pixels[i] = 20000.0F + 100.0F * static_cast<float>(i % 97);
  }
  raw.calibration.width = 32;
  raw.calibration.height = 24;
  raw.calibration.k = {1000, 0, 15.5, 0, 1000, 11.5, 0, 0, 1};
  return raw;
}

inline RigidTransform somePose(double x_mm = 0.0) {
  RigidTransform T = RigidTransform::Identity();
  T.translation() = Eigen::Vector3d(x_mm, 0.0, 900.0);
  return T;
}

}  // namespace xray_registration

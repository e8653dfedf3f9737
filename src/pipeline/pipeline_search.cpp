#include "pipeline/pipeline_search.h"

#include <utility>

#include "pipeline/failure_text.h"
#include "pipeline/present_views.h"
#include "xray_registration/common/stopwatch.h"
#include "xray_registration/drr/device.h"

namespace xray_registration {
namespace {

std::vector<RigidTransform> placesOf(const PipelineSearch* search) {
  return search != nullptr && search->search ? search->search->places() : std::vector<RigidTransform>{};
}

}  // namespace

RegistrationPipeline::~RegistrationPipeline() = default;

std::string RegistrationPipeline::beginSearch(double stamp_s, std::vector<RawView> views,
                                              const WideSearchRange& range) {
  FrameOutcome frame;
  std::string problem = viewsProblem(std::move(views), &frame);
  return problem.empty() ? startSearch(stamp_s, std::move(frame), range) : problem;
}

std::string RegistrationPipeline::startSearch(double stamp_s, FrameOutcome frame, const WideSearchRange& range) {
  dropSearch();
  if (!frame.views.front()) return "a wide search needs the first view, which is missing: " + frame.missing_because;
  auto begun = std::make_unique<PipelineSearch>();
  begun->stamp_s = stamp_s;
  begun->frame = std::move(frame);
  try {
    begun->search = body_.registrar->searchWidely(presentViews(begun->frame.views), range);
  } catch (const DeviceError& error) {
    rebuildAfter(error.what());
    return std::string("the device failed: ") + error.what();
  } catch (const std::exception& error) {
    return "the wide search failed: " + inWords(error);
  }
  if (!begun->search) return "the method (parameter method) knows no wide search; method: fast does";
  search_ = std::move(begun);
  return "";
}

/// LOST: slices of a wide search in one of the frames that were not found, then the newest frame among its places.
bool RegistrationPipeline::registerWhatIsFound(double stamp_s,
                                               const std::optional<RigidTransform>& T_camera_now_camera_last,
                                               FrameOutcome* outcome) {
  const Stopwatch watch;
  if (!search_) {
    WideSearchRange range;
    range.T_camera_ct_centre = body_.tracker.prediction(stamp_s, T_camera_now_camera_last);
    range.rotation_rad = kRecoverRotationRad;
    range.translation_mm = kRecoverTranslationMm;
    outcome->result.reason = startSearch(stamp_s, *outcome, range);
    if (!outcome->result.reason.empty()) {
      recovery_.searched();
      return false;
    }
  }
  bool goes_on = true;
  while (goes_on && watch.milliseconds() < kRecoverSliceMs) goes_on = advanceSearch();
  if (goes_on) {
    outcome->result.reason = "the CT is lost: a wide search for it goes on, " +
                             std::to_string(static_cast<int>(100.0 * searchProgress())) + " % done";
    return false;
  }
  const std::vector<RigidTransform> places = placesOf(search_.get());
  dropSearch();
  recovery_.searched();
  complete(stamp_s, T_camera_now_camera_last, places, outcome);
  return true;
}

bool RegistrationPipeline::advanceSearch() {
  if (!search_ || !search_->failure.empty()) return false;
  try {
    return search_->search->advance();
  } catch (const DeviceError& error) {
    const std::string failure = std::string("the device failed: ") + error.what();
    auto failed = std::move(search_);
    failed->search.reset();  // It stands on what is closed now.
    rebuildAfter(error.what());
    failed->failure = failure;
    search_ = std::move(failed);
  } catch (const std::exception& error) {
    search_->failure = "the wide search failed: " + inWords(error);
  }
  return false;
}

double RegistrationPipeline::searchProgress() const {
  return search_ && search_->search ? search_->search->progress() : 0.0;
}

double RegistrationPipeline::searchBestSimilarity() const {
  return search_ && search_->search ? search_->search->bestSimilarity() : -1.0;
}

FrameOutcome RegistrationPipeline::finishSearch(const std::function<bool()>& is_wanted) {
  const Stopwatch watch;
  if (!search_) {
    FrameOutcome ended;
    ended.result.reason = "the wide search was ended before it was done";
    ended.state = state();
    return ended;
  }
  const std::unique_ptr<PipelineSearch> done = std::move(search_);
  FrameOutcome& outcome = done->frame;
  const std::vector<RigidTransform> places = placesOf(done.get());
  done->search.reset();
  if (!done->failure.empty() || places.empty() || !device_.isReady(&body_)) {
    outcome.result.reason = !done->failure.empty() ? done->failure
                            : !fault().empty()     ? fault()
                                                   : "the wide search found nothing that looks like the CT";
    refuseBodies(outcome.result.reason, &outcome.result);
    refuseOwn(&outcome.result);
  } else {
    const Tracker before = body_.tracker;
    const std::optional<double> accepted_before = body_.last_accepted_s;
    setPose(places.front());
    complete(done->stamp_s, std::nullopt, places, &outcome);
    if (is_wanted && !is_wanted()) {
      outcome.result.accepted = false;
      outcome.result.reason = "the wide search was ended before it was done";
      refuseBodies(outcome.result.reason, &outcome.result);
      refuseOwn(&outcome.result);
    }
    if (!outcome.result.accepted) {
      body_.tracker = before;
      body_.last_accepted_s = accepted_before;
    }
  }
  outcome.state = state();
  outcome.total_ms = watch.milliseconds();
  return std::move(outcome);
}

void RegistrationPipeline::dropSearch() { search_.reset(); }

}  // namespace xray_registration

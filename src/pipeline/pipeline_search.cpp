#include "pipeline/pipeline_search.h"

#include <utility>

#include "pipeline/failure_text.h"
#include "pipeline/present_views.h"
#include "xray_registration/common/stopwatch.h"
#include "xray_registration/drr/device.h"

namespace xray_registration {

RegistrationPipeline::~RegistrationPipeline() = default;

std::string RegistrationPipeline::beginSearch(double stamp_s, std::vector<RawView> views,
                                              const WideSearchRange& range) {
  dropSearch();
  auto begun = std::make_unique<PipelineSearch>();
  begun->stamp_s = stamp_s;
  std::string problem = viewsProblem(std::move(views), &begun->frame);
  if (!problem.empty()) return problem;
  if (!begun->frame.views.front()) {
    return "a wide search needs the first view, which is missing: " + begun->frame.missing_because;
  }
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

FrameOutcome RegistrationPipeline::finishSearch() {
  const Stopwatch watch;
  if (!search_) {
    FrameOutcome ended;
    ended.result.reason = "the wide search was ended before it was done";
    ended.state = state();
    return ended;
  }
  const std::unique_ptr<PipelineSearch> done = std::move(search_);
  FrameOutcome& outcome = done->frame;
  const std::vector<RigidTransform> places = done->search ? done->search->places() : std::vector<RigidTransform>{};
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

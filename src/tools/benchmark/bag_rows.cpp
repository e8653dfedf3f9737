#include "tools/benchmark/bag_rows.h"

#include <filesystem>
#include <stdexcept>

#include "tools/common/bag_frames.h"
#include "tools/common/progress_bar.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration::tools {
namespace {

struct Session {
  std::unique_ptr<BagSession> bag;
  std::vector<double> stamps;
  std::vector<std::vector<RawView>> frames;  // In memory, so that no disk is timed.
  RigidTransform first_pose;
};

Session readSession(const std::string& path, const std::vector<std::string>& views, const Logger& logger) {
  Session session;
  BagSessionOptions options;
  options.views = views;
  session.bag = std::make_unique<BagSession>(path, options, logger);
  for (std::size_t i = 0; i < session.bag->frameCount(); ++i) {
    const BagFrame frame = session.bag->frame(i);
    if (i == 0) {
      if (!frame.T_first_ct_true)
        throw std::runtime_error(path + ": the first frame has no ground_truth to start from");
      session.first_pose = *frame.T_first_ct_true;
    }
    session.stamps.push_back(frame.stamp.toSec());
    session.frames.push_back(rawViews(*session.bag, frame));
  }
  // Of a single frame, tracking is finding it again.
  constexpr int kAgain = 4;
  for (int i = 1; session.bag->frameCount() == 1 && i <= kAgain; ++i) {
    session.stamps.push_back(session.stamps.front() + 0.1 * i);
    session.frames.push_back(session.frames.front());
  }
  return session;
}

/// Of passes over a session; each begins with a cold start.
struct Times {
  std::vector<double> cold_ms;
  std::vector<double> tracked_ms;
  int cold_accepted = 0;
  int tracked_accepted = 0;
};

/// One pass over the session from its first true pose.
void follow(const Session& session, RegistrationPipeline* pipeline, Times* times) {
  pipeline->setPose(session.first_pose);
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    const FrameOutcome outcome = pipeline->process(session.stamps[i], session.frames[i]);
    if (pipeline->state() == TrackingState::kFault) throw std::runtime_error("device failed: " + pipeline->fault());
    (i == 0 ? times->cold_ms : times->tracked_ms).push_back(outcome.total_ms);
    (i == 0 ? times->cold_accepted : times->tracked_accepted) += outcome.result.accepted ? 1 : 0;
  }
}

BenchmarkRow acceptedRow(const std::string& name, const std::vector<double>& times, int accepted) {
  BenchmarkRow row = rowOf(name, times);
  row.note = std::to_string(accepted) + " of " + std::to_string(times.size()) + " frames accepted";
  return row;
}

Times measure(const std::string& name, const Session& session, const Volume& ct, NodeParameters parameters,
              Method method, int passes, const Logger& logger) {
  parameters.registrar.method = method;
  parameters.views = viewParameter(*session.bag);
  RegistrationPipeline pipeline(parameters, logger);
  pipeline.setCt(ct);
  pipeline.dropCt();
  ProgressBar bar(name, static_cast<std::size_t>(passes) + 1);
  Times times;
  follow(session, &pipeline, &times);  // Warms up.
  times = {};
  for (int pass = 0; pass < passes; ++pass) {
    bar.advanceTo(static_cast<std::size_t>(pass) + 1);
    follow(session, &pipeline, &times);
  }
  return times;
}

/// The bag's name; with one of its views, that one's as well.
std::string nameOf(const std::string& bag, const std::vector<std::string>& views) {
  const std::string name = std::filesystem::path(bag).stem().string();
  return views.size() == 1 && !views.front().empty() ? name + "_" + views.front() : name;
}

}  // namespace

std::vector<BenchmarkRow> measureTrackedFrames(const std::string& ct, const std::string& bag,
                                               const std::vector<std::string>& views, const std::string& device,
                                               int passes, const Logger& logger) {
  const Session session = readSession(bag, views, logger);
  const Volume volume = readVolume(ct, {}, logger);
  NodeParameters parameters;
  parameters.device = device;
  const std::string name = nameOf(bag, views);
  std::vector<BenchmarkRow> rows;
  const Times fast = measure(name, session, volume, parameters, Method::kFast, passes, logger);
  if (!fast.tracked_ms.empty()) {
    rows.push_back(acceptedRow("tracked_frame/" + name, fast.tracked_ms, fast.tracked_accepted));
  }
  rows.push_back(acceptedRow("cold_start/" + name, fast.cold_ms, fast.cold_accepted));
  if (session.bag->views().size() == 1) {
    const Times paper = measure("paper, " + name, session, volume, parameters, Method::kPaper, 1, logger);
    rows.push_back(acceptedRow("tracked_frame/paper/" + name, paper.tracked_ms, paper.tracked_accepted));
  }
  return rows;
}

}  // namespace xray_registration::tools

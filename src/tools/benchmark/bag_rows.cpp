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
  return session;
}

/// One pass over the session from its first true pose.
void follow(const Session& session, RegistrationPipeline* pipeline, std::vector<double>* times, int* accepted) {
  pipeline->setPose(session.first_pose);
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    const FrameOutcome outcome = pipeline->process(session.stamps[i], session.frames[i]);
    if (pipeline->state() == TrackingState::kFault) throw std::runtime_error("device failed: " + pipeline->fault());
    times->push_back(outcome.total_ms);
    *accepted += outcome.result.accepted ? 1 : 0;
  }
}

BenchmarkRow measure(const std::string& name, const Session& session, const Volume& ct, NodeParameters parameters,
                     Method method, int passes, const Logger& logger) {
  parameters.registrar.method = method;
  parameters.views = viewParameter(*session.bag);
  RegistrationPipeline pipeline(parameters, logger);
  pipeline.setCt(ct);
  pipeline.dropCt();
  ProgressBar bar(name, static_cast<std::size_t>(passes) + 1);
  std::vector<double> times;
  int accepted = 0;
  follow(session, &pipeline, &times, &accepted);  // Warms up.
  times.clear();
  accepted = 0;
  for (int pass = 0; pass < passes; ++pass) {
    bar.advanceTo(static_cast<std::size_t>(pass) + 1);
    follow(session, &pipeline, &times, &accepted);
  }
  BenchmarkRow row = rowOf(name, times);
  row.note = std::to_string(accepted) + " of " + std::to_string(times.size()) + " frames accepted";
  return row;
}

}  // namespace

std::vector<BenchmarkRow> measureTrackedFrames(const std::string& ct, const std::string& bag,
                                               const std::vector<std::string>& views, const std::string& device,
                                               int passes, const Logger& logger) {
  const Session session = readSession(bag, views, logger);
  const Volume volume = readVolume(ct, {}, logger);
  NodeParameters parameters;
  parameters.device = device;
  const std::string name = std::filesystem::path(bag).stem().string();
  std::vector<BenchmarkRow> rows;
  rows.push_back(measure("tracked_frame/" + name, session, volume, parameters, Method::kFast, passes, logger));
  if (session.bag->views().size() == 1) {
    rows.push_back(measure("tracked_frame/paper/" + name, session, volume, parameters, Method::kPaper, 1, logger));
  }
  return rows;
}

}  // namespace xray_registration::tools

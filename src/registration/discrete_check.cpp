#include "registration/discrete_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "registration/discrete_hypotheses.h"
#include "registration/frame_objective.h"
#include "registration/pose_search.h"
#include "xray_registration/image/image_pyramid.h"

namespace xray_registration {
namespace {

/// Side and orientation show in small images.
constexpr int kSide = 128;
/// Of a view with CT behind them.
constexpr double kPixels = 12000.0;
constexpr int kSteps = 10;
/// σ, and how much more likeness than the solution's, that is no chance.
constexpr double kBetter = 2.5;
constexpr double kBetterLikeness = 0.02;
/// A likeness that leaves no room for anything that is so much better. A head whose X-ray is mirrored reaches 0.97 from
/// its other side.
constexpr double kNothingBetter = 1.0 - kBetterLikeness;
/// Likeness on the coarsest level that a hypothesis may lack against the solution's and still be looked at closer.
constexpr double kWorthALook = 0.05;

ViewInput reduced(const ViewInput& view) {
  const int factor = std::max(1, std::min(view.xray->camera.width, view.xray->camera.height) / kSide);
  if (factor == 1) return view;
  XrayFrame frame;
  frame.camera = view.xray->camera.binned(factor);
  binImage(view.xray->attenuation, view.xray->mask, factor, &frame.attenuation, &frame.mask);
  ViewInput small = view;
  small.xray = std::make_shared<const XrayFrame>(std::move(frame));
  return small;
}

/// How well a frame's small images are explained.
struct Likeness {
  double mean = -1.0;
  double sigma = 0.0;  ///< Of the mean, from the windows.
};

/// Small images on the device, with the objective over them.
class SmallFrame {
 public:
  SmallFrame(Engine* engine, const PutRight& frame, const RegistrarOptions& options)
      : views_(engine), budget_(std::numeric_limits<int>::max()), objective_(engine, &views_, options, &budget_) {
    views_.upload(frame.views, frame.T_camera_ct_start, kPixels);
    solution_.T_camera_ct = frame.T_camera_ct_start;
  }

  int coarsest() { return views_.coarsestLevel(solution_.T_camera_ct); }

  /// Searches around the start on a level, or on the coarsest that there is; the likeness there.
  double search(int level) {
    level = std::min(level, views_.lastLevel());
    const Similarity similarity = objective_.options().similarity;
    solution_.T_camera_ct =
        searchAround(&objective_, {level, coarseSpan(similarity), kSteps}, solution_.T_camera_ct, 1, 1).front();
    return refine(level);
  }

  /// Goes on to a level from where it stands; the likeness there.
  double refine(int level) {
    const Similarity similarity = objective_.options().similarity;
    objective_.solve({level, coarseSpan(similarity), kSteps}, &solution_);
    return solution_.failed ? -1.0 : solution_.sums.similarity;
  }

  Likeness likenessOn(int level) {
    for (int i = level + 1; i >= level; --i) {
      if (i <= views_.lastLevel()) refine(i);
    }
    const std::vector<float> windows =
        objective_.correlations({level, finestSpan(objective_.options().similarity), 1}, solution_.T_camera_ct);
    Likeness likeness;
    if (windows.size() < 2 || solution_.failed) return likeness;
    double sum = 0.0;
    double sum2 = 0.0;
    for (const float correlation : windows) {
      sum += correlation;
      sum2 += static_cast<double>(correlation) * correlation;
    }
    const auto count = static_cast<double>(windows.size());
    likeness.mean = sum / count;
    likeness.sigma = std::sqrt(std::max(sum2 / count - likeness.mean * likeness.mean, 0.0) / count);
    return likeness;
  }

 private:
  DeviceViews views_;
  StepBudget budget_;
  FrameObjective objective_;
  Solution solution_;
};

}  // namespace

DiscreteOpinion checkDiscrete(Engine* engine, const std::vector<ViewInput>& views,
                              const RigidTransform& T_camera_ct_start, const Solution& solution, bool found,
                              const RegistrarOptions& options) {
  if (found && solution.likeness() > kNothingBetter) return {};
  PutRight told{{}, solution.T_camera_ct};
  std::vector<std::string> names;
  names.reserve(views.size());
  told.views.reserve(views.size());
  for (const ViewInput& view : views) {
    told.views.push_back(reduced(view));
    names.push_back(view.name);
  }
  SmallFrame as_told(engine, told, options);
  const int coarsest = as_told.coarsest();
  const double coarse_likeness = as_told.refine(coarsest);
  const Likeness told_likeness = as_told.likenessOn(0);

  DiscreteOpinion opinion;
  double most = kBetter;
  const DiscreteHypotheses hypotheses(names);
  for (std::size_t i = 0; i < hypotheses.all().size(); ++i) {
    const DiscreteHypothesis& hypothesis = hypotheses.all()[i];
    if (found && !hypothesis.keeps_likeness) continue;
    SmallFrame other(
        engine,
        hypotheses.putRight(i, told.views, T_camera_ct_start, solution.T_camera_ct, engine->volume().centreCt()),
        options);
    if (other.search(coarsest) < coarse_likeness - kWorthALook) continue;
    const Likeness likeness = other.likenessOn(0);
    const double gain = likeness.mean - told_likeness.mean;
    const double sigma = std::hypot(likeness.sigma, told_likeness.sigma);
    if (likeness.mean < options.accept.min_similarity || gain < kBetterLikeness || gain < most * sigma) continue;
    most = gain / sigma;
    opinion.suspicions = {{hypothesis.what, hypothesis.in_words, gain, sigma, "", 0.0, true}};
    opinion.refusal = hypothesis.in_words + ": that would explain it better than what was told (likeness " +
                      std::to_string(likeness.mean).substr(0, 5) + " instead of " +
                      std::to_string(told_likeness.mean).substr(0, 5) + "); " + hypothesis.remedy;
  }
  return opinion;
}

}  // namespace xray_registration

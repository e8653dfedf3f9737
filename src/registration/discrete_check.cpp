#include "registration/discrete_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "registration/discrete_hypotheses.h"
#include "registration/frame_objective.h"
#include "registration/pose_search.h"
#include "xray_registration/geometry/angles.h"
#include "xray_registration/image/image_pyramid.h"

namespace xray_registration {
namespace {

/// Side and orientation show in small images.
constexpr int kSide = 128;
/// Of a view with CT behind them: where hypotheses are searched for, and where what is left of them is compared.
constexpr double kSearchedPixels = 700.0;
constexpr double kPixels = 12000.0;
constexpr int kSteps = 10;
/// Around the start, where what was told wrongly would be put right; the start itself is nearly always near enough.
constexpr int kSearchPoses = 32;
/// σ, and how much more likeness than the solution's, that is no chance.
constexpr double kBetter = 2.5;
constexpr double kBetterLikeness = 0.02;
/// A likeness that leaves no room for anything that is so much better. A head whose X-ray is mirrored reaches 0.97 from
/// its other side.
constexpr double kNothingBetter = 1.0 - kBetterLikeness;
/// Likeness in the searched images that a hypothesis may lack against the solution's and still be looked at closer.
constexpr double kWorthALook = 0.05;
/// What lacks so much more after some steps of a search will not make up for it.
constexpr double kHopeless = 0.1;
/// A start so near to where a mirrored X-ray fits is none that was far off.
constexpr double kNearStartRad = 0.5;

std::string inWords(double likeness) { return std::to_string(likeness).substr(0, 5); }

std::string inDegrees(double angle_rad) { return std::to_string(std::lround(angle_rad * kDegreesPerRadian)); }

ViewInput reduced(const ViewInput& view, int factor) {
  if (factor == 1) return view;
  ViewInput small = view;
  small.xray = std::make_shared<const XrayFrame>(binned(*view.xray, factor));
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
  SmallFrame(Engine* engine, const PutRight& frame, const RegistrarOptions& options, double pixels = kPixels)
      : options_(options),
        views_(engine),
        budget_(std::numeric_limits<int>::max()),
        objective_(engine, &views_, options_, &budget_) {
    options_.search_poses = std::min(options.search_poses, kSearchPoses);
    views_.upload(frame.views, frame.T_camera_ct_start, pixels);
    solution_.T_camera_ct = frame.T_camera_ct_start;
  }

  const RigidTransform& pose() const { return solution_.T_camera_ct; }
  int coarsest() { return views_.coarsestLevel(pose()); }
  int binningOf(std::size_t view) const {
    const DeviceViews::View& seen = views_.views()[view];
    return static_cast<int>(std::lround(seen.told.fx / seen.level(0).camera.fx));
  }

  /// Searches around where it stands on a level, or on the coarsest that there is; the likeness there. What stays below
  /// `hopeless` is not followed to its end.
  double search(int level, double hopeless = -1.0) {
    level = std::min(level, views_.lastLevel());
    const Stage stage{level, coarseSpan(objective_.options().similarity), kSteps};
    solution_.T_camera_ct = searchAround(&objective_, stage, pose(), 1, 1, hopeless).front();
    return refine(level);
  }

  /// Goes on to a level, or to the coarsest that there is, from where it stands; the likeness there.
  double refine(int level) {
    level = std::min(level, views_.lastLevel());
    const Similarity similarity = objective_.options().similarity;
    objective_.solve({level, coarseSpan(similarity), kSteps}, &solution_);
    return solution_.failed ? -1.0 : solution_.sums.similarity;
  }

  /// On the finest level, after a descent to it.
  Likeness likeness() {
    for (int level = coarsest(); level >= 0; --level) {
      if (level != 0 && level != 1 && level != coarsest()) continue;
      refine(level);
    }
    const std::vector<float> windows =
        objective_.correlations({0, finestSpan(objective_.options().similarity), 1}, pose());
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
  RegistrarOptions options_;
  DeviceViews views_;
  StepBudget budget_;
  FrameObjective objective_;
  Solution solution_;
};

/// The hypothesis that explains a frame best so far, and where the CT is then.
struct Explained {
  const DiscreteHypothesis* hypothesis;
  RigidTransform T_camera_ct;
  Likeness likeness;
};

/// A mirror image of the CT's is what the CT itself looks like from its other side, nearly. When an X-ray looks
/// mirrored far from the start, it may be the start that is wrong.
/// @return why; "" when no such start explains as much as the mirrored X-ray.
std::string wrongStart(Engine* engine, const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start,
                       const RigidTransform& T_camera_ct_mirrored, const Likeness& mirrored,
                       const RegistrarOptions& options) {
  const XrayCamera& camera = views.front().xray->camera;
  for (const RigidTransform& T_camera_ct : otherSides(T_camera_ct_mirrored, camera, engine->volume().centreCt())) {
    SmallFrame plain(engine, {views, T_camera_ct}, options);
    plain.search(plain.coarsest());
    const Likeness likeness = plain.likeness();
    if (likeness.mean < mirrored.mean - kBetterLikeness) continue;
    return "the start looks wrong: turned by " + inDegrees(rotationAngleBetween(plain.pose(), T_camera_ct_start)) +
           " degrees the CT would look like the X-ray (likeness " + inWords(likeness.mean) +
           "); give another start, or search for one (~localize)";
  }
  return "";
}

}  // namespace

DiscreteOpinion checkDiscrete(Engine* engine, const std::vector<ViewInput>& views,
                              const RigidTransform& T_camera_ct_start, const Solution& solution, bool found,
                              const RegistrarOptions& options) {
  if (found && solution.likeness() > kNothingBetter) return {};
  // What is searched for shows in smaller images than what is compared.
  SmallFrame as_told(engine, {views, solution.T_camera_ct}, options, kSearchedPixels);
  const int level = as_told.coarsest();
  const double least = as_told.refine(level) - kWorthALook;
  PutRight told{{}, solution.T_camera_ct};
  PutRight smaller = told;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const XrayCamera& camera = views[i].xray->camera;
    told.views.push_back(reduced(views[i], std::max(1, std::min(camera.width, camera.height) / kSide)));
    smaller.views.push_back(reduced(views[i], as_told.binningOf(i)));
    names.push_back(views[i].name);
  }
  std::optional<Likeness> told_likeness;

  DiscreteOpinion opinion;
  std::optional<Explained> best;
  double most = kBetter;
  const Eigen::Vector3d centre_ct = engine->volume().centreCt();
  const DiscreteHypotheses hypotheses(names);
  for (std::size_t i = 0; i < hypotheses.all().size(); ++i) {
    const DiscreteHypothesis& hypothesis = hypotheses.all()[i];
    if (found && !hypothesis.keeps_likeness) continue;
    SmallFrame other(engine, hypotheses.putRight(i, smaller.views, T_camera_ct_start, solution.T_camera_ct, centre_ct),
                     options);
    if (other.search(level, least - kHopeless) < least) continue;
    if (!told_likeness) told_likeness = SmallFrame(engine, told, options).likeness();
    PutRight closer = hypotheses.putRight(i, told.views, T_camera_ct_start, solution.T_camera_ct, centre_ct);
    closer.T_camera_ct_start = other.pose();
    SmallFrame closer_frame(engine, closer, options);
    const Likeness likeness = closer_frame.likeness();
    const double gain = likeness.mean - told_likeness->mean;
    const double sigma = std::hypot(likeness.sigma, told_likeness->sigma);
    if (likeness.mean < options.accept.min_similarity || gain < kBetterLikeness || gain < most * sigma) continue;
    most = gain / sigma;
    best = Explained{&hypothesis, closer_frame.pose(), likeness};
    opinion.suspicions = {{hypothesis.what, hypothesis.in_words, gain, sigma, "", 0.0, true}};
  }
  if (!best) return opinion;
  opinion.refusal = best->hypothesis->in_words + ": that would explain it better than what was told (likeness " +
                    inWords(best->likeness.mean) + " instead of " + inWords(told_likeness->mean) + "); " +
                    best->hypothesis->remedy;
  const double from_start_rad = rotationAngleBetween(best->T_camera_ct, T_camera_ct_start);
  if (found || best->hypothesis->what != "mirrored_image" || from_start_rad < kNearStartRad) return opinion;
  const std::string problem =
      wrongStart(engine, told.views, T_camera_ct_start, best->T_camera_ct, best->likeness, options);
  if (!problem.empty()) return {{}, problem};
  opinion.refusal += ", and the start, which is " + inDegrees(from_start_rad) + " degrees off then";
  return opinion;
}

}  // namespace xray_registration

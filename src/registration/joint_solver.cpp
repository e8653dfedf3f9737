#include "registration/joint_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "xray_registration/common/statistics.h"

namespace xray_registration {
namespace {

/// A step is the end when it changes no parameter by this share of what matters, and no pose by more than that.
constexpr double kStopShare = 0.02;
constexpr double kStopMm = 0.02;
constexpr double kFirstDamping = 1e-3;
constexpr double kLeastDamping = 1e-7;
/// Directions that are seen weakly are for the finest level.
constexpr double kLeastCoarseDamping = 1e-4;
constexpr double kMostDamping = 1e3;
/// While the damping is larger, a short step is no sign of a minimum in a direction that is seen weakly.
constexpr double kUndamped = 1e-5;
/// Share of its own curvature below which a direction is not seen: single precision's.
constexpr double kUnseen = 1e-6;
constexpr double kHugeVariance = 1e12;
/// Along the side of a block of windows whose errors may be one, on the finest level.
constexpr int kBlockTiles = 4;

/// View, column, row.
using Block = std::tuple<std::size_t, int, int>;
Block blockOf(const SetupWindow& window, int level) {
  const int tiles = std::max(kBlockTiles >> level, 1);
  return {window.view, window.x / tiles, window.y / tiles};
}

JointEvidence summed(std::vector<SetupEvidence> frames, const Stage& stage) {
  JointEvidence evidence;
  evidence.level = stage.level;
  evidence.frames = std::move(frames);
  evidence.finite = true;
  for (const SetupEvidence& frame : evidence.frames) {
    evidence.cost += frame.cost;
    evidence.finite &= frame.finite();
  }
  return evidence;
}

/// At three times its median error a window keeps a quarter of its weight, as in a single frame's objective.
double robustScale(const SetupEvidence& evidence) {
  std::vector<double> errors;
  for (const SetupWindow& window : evidence.windows) errors.push_back(1.0 - window.correlation);
  return std::max(0.1, 3.0 * median(errors));
}

/// The arrow-shaped normal equations of all frames, damped: every parameter's curvature grows by the same share.
class ArrowSystem {
 public:
  ArrowSystem(const JointEvidence& evidence, const std::vector<Eigen::MatrixXd>& bases, double damping) {
    const Eigen::Index size = bases.front().cols();
    matrix_ = Eigen::MatrixXd::Zero(size, size);
    gradient_ = Eigen::VectorXd::Zero(size);
    for (std::size_t i = 0; i < bases.size(); ++i) addFrame(evidence.frames[i], bases[i], damping);
  }

  /// Of what is shared; then poses() has the frames' own. False when there is no solution.
  bool solve() {
    step_ = Eigen::VectorXd::Zero(gradient_.size());
    if (!solvable_) return false;
    if (step_.size() == 0) return true;
    if (!(own_.minCoeff() > 0.0)) return false;
    const Eigen::VectorXd scale = own_.cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(scale.asDiagonal() * matrix_ * scale.asDiagonal());
    if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-12)) return false;
    step_ = scale.asDiagonal() * ldlt.solve(-(scale.asDiagonal() * gradient_));
    return step_.allFinite();
  }
  const Eigen::VectorXd& step() const { return step_; }
  std::vector<Twist> poses() const {
    std::vector<Twist> all;
    for (const Frame& frame : frames_) all.push_back(-frame.alone - frame.follows * step_);
    return all;
  }

 private:
  struct Frame {
    Twist alone;              ///< M_pp⁻¹ g_p
    Eigen::MatrixXd follows;  ///< M_pp⁻¹ M_ps
  };

  void addFrame(const SetupEvidence& seen, const Eigen::MatrixXd& basis, double damping) {
    Matrix6d pose = seen.matrix.topLeftCorner<6, 6>();
    pose.diagonal() *= 1.0 + damping;
    const Eigen::LDLT<Matrix6d> ldlt(pose);
    if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0.0)) {
      solvable_ = false;
      return;
    }
    const Eigen::MatrixXd cross = seen.matrix.topRows<6>() * basis;
    Frame frame{ldlt.solve(seen.gradient.head<6>()), cross};
    // Eigen's triangular solver takes the address of the first element, which nothing has when only poses are free.
    if (cross.cols() > 0) frame.follows = ldlt.solve(cross);
    Eigen::MatrixXd shared = basis.transpose() * seen.matrix * basis;
    shared.diagonal() *= 1.0 + damping;
    if (own_.size() == 0) own_ = Eigen::VectorXd::Zero(shared.rows());
    own_ += shared.diagonal();
    matrix_ += shared - cross.transpose() * frame.follows;
    gradient_ += basis.transpose() * seen.gradient - cross.transpose() * frame.alone;
    frames_.push_back(frame);
  }

  Eigen::MatrixXd matrix_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd own_;
  Eigen::VectorXd step_;
  std::vector<Frame> frames_;
  bool solvable_ = true;
};

bool isShort(const ArrowSystem& system, const FreeParameters& free) {
  if (free.size() > 0 && system.step().cwiseQuotient(free.limits()).cwiseAbs().maxCoeff() > kStopShare) return false;
  const std::vector<Twist> poses = system.poses();
  return std::all_of(poses.begin(), poses.end(), [](const Twist& pose) { return motionMm(pose) < kStopMm; });
}

std::vector<Eigen::MatrixXd> basesOf(const JointFrames& frames, const JointSetup& setup, const FreeParameters& free) {
  std::vector<Eigen::MatrixXd> bases;
  for (std::size_t i = 0; i < frames.size(); ++i) bases.push_back(free.basis(setup, i, frames.centreCt()));
  return bases;
}

JointSolution startOf(JointFrames* frames, const Stage& stage, const JointSetup& setup,
                      const std::vector<double>& robust_scales2) {
  JointSolution start{setup, {}, robust_scales2, false};
  if (robust_scales2.empty()) {
    const std::vector<double> none(frames->size(), kNotRobust);
    for (const SetupEvidence& frame : frames->evaluate(setup, stage, none)) {
      start.robust_scales2.push_back(robustScale(frame));
    }
  }
  start.evidence = summed(frames->evaluate(setup, stage, start.robust_scales2), stage);
  return start;
}

}  // namespace

JointSolution solveJointly(JointFrames* frames, const Stage& stage, const FreeParameters& free, const JointSetup& start,
                           const std::vector<double>& robust_scales2) {
  JointSolution best = startOf(frames, stage, start, robust_scales2);
  // Images that are straightened by another distortion are blurred otherwise: their costs cannot be compared.
  const bool tested = !free.bends();
  const double least = stage.level == 0 ? kLeastDamping : kLeastCoarseDamping;
  double damping = tested ? kFirstDamping : least;
  bool refused = false;
  for (int i = 0; i < stage.max_steps && damping < kMostDamping && best.evidence.finite;) {
    ArrowSystem system(best.evidence, basesOf(*frames, best.setup, free), damping);
    if (!system.solve()) {
      damping *= 10.0;
      continue;
    }
    best.converged = isShort(system, free);
    if (best.converged && (refused || damping <= std::max(kUndamped, least))) break;
    if (best.converged) {
      damping *= 0.1;
      continue;
    }
    const JointSetup moved = free.moved(best.setup, system.step(), system.poses(), frames->centreCt());
    JointEvidence evidence = summed(frames->evaluate(moved, stage, best.robust_scales2), stage);
    ++i;
    refused = !evidence.finite || (tested && evidence.cost >= best.evidence.cost);
    if (!refused) {
      best.setup = moved;
      best.evidence = std::move(evidence);
    }
    damping = refused ? 10.0 * damping : std::max(0.1 * damping, least);
  }
  return best;
}

double betterBy(const JointEvidence& one, const JointEvidence& other) {
  std::map<Block, double> gains;
  for (const SetupEvidence& frame : other.frames) {
    for (const SetupWindow& window : frame.windows) gains[blockOf(window, other.level)] += window.cost;
  }
  for (const SetupEvidence& frame : one.frames) {
    for (const SetupWindow& window : frame.windows) gains[blockOf(window, one.level)] -= window.cost;
  }
  double sum = 0.0;
  double sum2 = 0.0;
  for (const auto& [block, gain] : gains) {
    sum += gain;
    sum2 += gain * gain;
  }
  return sum2 > 0.0 ? sum / std::sqrt(sum2) : 0.0;
}

Score jointScore(const JointFrames& frames, const JointSolution& solution, const FreeParameters& free) {
  Score score;
  std::map<Block, Eigen::VectorXd> blocks;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const SetupEvidence& seen = solution.evidence.frames[i];
    const Eigen::MatrixXd basis = free.basis(solution.setup, i, frames.centreCt());
    const Score own = scoreOf(seen, basis);
    if (own.empty()) continue;
    score.add(own);
    const Eigen::MatrixXd parts =
        basis.transpose() * seen.gradients - own.follows.transpose() * seen.gradients.topRows<6>();
    for (std::size_t w = 0; w < seen.windows.size(); ++w) {
      Eigen::VectorXd& block = blocks[blockOf(seen.windows[w], solution.evidence.level)];
      if (block.size() == 0) block = Eigen::VectorXd::Zero(parts.rows());
      block += parts.col(static_cast<Eigen::Index>(w));
    }
  }
  if (score.empty()) return score;
  score.scatter.setZero();
  for (const auto& [place, block] : blocks) score.scatter += block * block.transpose();
  return score;
}

Eigen::MatrixXd jointCovariance(const Score& score) {
  const Eigen::VectorXd scale = score.own.cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * score.curvature * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const Eigen::MatrixXd axes = scale.asDiagonal() * eigen.eigenvectors();
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(scale.size());
  Eigen::VectorXd unseen = Eigen::VectorXd::Zero(scale.size());
  for (Eigen::Index i = 0; i < inverse.size(); ++i) {
    const bool seen = eigen.eigenvalues()[i] > kUnseen;
    (seen ? inverse : unseen)[i] = seen ? 1.0 / eigen.eigenvalues()[i] : kHugeVariance;
  }
  const Eigen::MatrixXd half = axes * inverse.asDiagonal() * axes.transpose();
  return half * score.scatter * half + axes * unseen.asDiagonal() * axes.transpose();
}

double similarityOf(const JointEvidence& evidence) {
  double sum = 0.0;
  double weight = 0.0;
  for (const SetupEvidence& frame : evidence.frames) {
    for (const SetupWindow& window : frame.windows) {
      sum += window.content * window.correlation;
      weight += window.content;
    }
  }
  return weight > 0.0 ? sum / weight : 0.0;
}

}  // namespace xray_registration

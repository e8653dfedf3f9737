#include "xray_registration/evaluation/body_statistics.h"

#include <algorithm>

namespace xray_registration {
namespace {

constexpr double kGoodMm = 1.0;
constexpr double kWrongMm = 2.0;

struct Errors {
  std::vector<double> mtre_mm;
  std::vector<double> inplane_mm;
};

void add(const BodyTrial& trial, std::size_t views, BodyStatistics* statistics) {
  const double error_mm = views > 1 ? trial.final.mtre_mm : trial.final.inplane_mm;
  const bool good = trial.result.solved && error_mm < kGoodMm;
  ++statistics->trials;
  statistics->successes += good ? 1 : 0;
  statistics->accepted += trial.result.accepted ? 1 : 0;
  statistics->false_acceptances += trial.result.accepted && error_mm > kWrongMm ? 1 : 0;
  statistics->false_refusals += good && !trial.result.accepted ? 1 : 0;
}

}  // namespace

std::vector<BodyStatistics> bodyStatisticsOf(const std::vector<Trial>& trials, std::size_t views) {
  std::vector<BodyStatistics> all;
  std::vector<Errors> errors;
  for (const Trial& trial : trials) {
    for (const BodyTrial& body : trial.bodies) {
      auto found = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == body.result.name; });
      if (found == all.end()) {
        all.emplace_back().name = body.result.name;
        errors.emplace_back();
        found = all.end() - 1;
      }
      add(body, views, &*found);
      Errors& own = errors[static_cast<std::size_t>(found - all.begin())];
      own.mtre_mm.push_back(body.final.mtre_mm);
      own.inplane_mm.push_back(body.final.inplane_mm);
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].mtre_mm = percentiles(errors[i].mtre_mm);
    all[i].inplane_mm = percentiles(errors[i].inplane_mm);
  }
  return all;
}

}  // namespace xray_registration

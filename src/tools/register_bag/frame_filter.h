#pragma once

#include <ros/time.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "xray_registration/pipeline/held_image.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// What the live node does beside registering, for the frames of a bag in their order: it refuses what could not stand
/// in tf and what is no new image, and loses track when nothing can be looked at for too long. The recording's stamps
/// are the time.
class FrameFilter {
 public:
  FrameFilter(const BagSession& session, const NodeParameters& parameters);

  /// tf frame of the first view in this frame.
  std::string frameId(const BagFrame& frame) const;

  /// Why a frame is not registered; empty when it is. Tells the pipeline what follows from that for its state. To be
  /// asked once of each frame.
  std::string problem(const BagFrame& frame, RegistrationPipeline* pipeline);

  /// To be told of each frame that the solver looked at.
  void noteLookedAt(const ros::Time& stamp) { last_looked_at_ = stamp; }

 private:
  struct Held {
    std::string problem;
    double longest_s = 0.0;
  };
  Held held(const BagFrame& frame);
  void watch(const ros::Time& stamp, RegistrationPipeline* pipeline) const;

  const BagSession& session_;
  FrameParameters frames_;
  std::vector<BodyParameters> bodies_;
  HealthParameters health_;
  bool allow_missing_view_;
  std::set<ros::Time> stamps_;
  std::vector<HeldImage> held_;  ///< Of each view.
  std::optional<ros::Time> last_looked_at_;
};

}  // namespace xray_registration::tools

#pragma once

#include <ros/time.h>

#include <set>
#include <string>
#include <vector>

#include "xray_registration/pipeline/held_image.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// What the live node refuses before it registers, for the frames of a bag in their order: what could not stand in tf,
/// and what is no new image.
class FrameFilter {
 public:
  FrameFilter(const BagSession& session, const NodeParameters& parameters);

  /// tf frame of the first view in this frame.
  std::string frameId(const BagFrame& frame) const;

  /// Why a frame is not registered; empty when it is. To be asked once of each frame.
  std::string problem(const BagFrame& frame);

 private:
  std::string heldProblem(const BagFrame& frame);

  const BagSession& session_;
  FrameParameters frames_;
  std::vector<BodyParameters> bodies_;
  bool allow_missing_view_;
  bool looks_for_held_;
  std::set<ros::Time> stamps_;
  std::vector<HeldImage> held_;  ///< Of each view.
};

}  // namespace xray_registration::tools

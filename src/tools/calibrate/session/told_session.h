#pragma once

#include <vector>

#include "xray_registration/evaluation/wrong_input.h"
#include "xray_registration/pipeline/corrected_views.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// A session's frames with the geometry that is told of them: the bag's, or a wrong one for a test.
class ToldSession {
 public:
  /// The session must outlive it. @throws ParameterError when a mask or a map cannot be read.
  ToldSession(const BagSession* session, const ImageParameters& image, std::vector<WrongInput> wrong);

  const BagSession& bag() const { return *session_; }

  /// As told.
  std::vector<RawView> raw(std::size_t frame) const;
  /// Pixels and cameras by a corrected geometry. @throws std::runtime_error for a frame that cannot be used.
  std::vector<ViewInput> views(std::size_t frame, const std::vector<ViewGeometry>& geometry);

 private:
  const BagSession* session_;
  std::vector<WrongInput> wrong_;
  FrameMaker maker_;
};

}  // namespace xray_registration::tools

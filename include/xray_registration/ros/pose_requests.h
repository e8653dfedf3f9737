#pragma once

#include <std_msgs/Header.h>

#include <map>
#include <optional>
#include <string>

#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/ros/transforms.h"

namespace xray_registration {

/// A start that somebody has given, in whatever frame.
struct PoseRequest {
  RigidTransform T_frame_object = RigidTransform::Identity();
  std::string frame_id;  ///< Empty: the first view's optical frame.
};

/// Starts of the CT and of bodies that wait for a frame, at whose stamp tf says where their frames are. Not
/// thread-safe.
class PoseRequests {
 public:
  /// `transforms` must outlive this.
  PoseRequests(const Transforms* transforms, double tf_timeout_s)
      : transforms_(transforms), tf_timeout_s_(tf_timeout_s) {}

  /// Of the body of this name; of the CT without one. A newer one takes the place of an older one.
  void add(const std::string& body, const PoseRequest& request) { requests_[body] = request; }
  void clear() { requests_.clear(); }

  /// Hands on what can be used: the CT's first, which puts the bodies where the CT has them, then those of bodies.
  /// Returns why the CT's cannot be used; then nothing is handed on, and the frame is to be refused. One of a body
  /// holds up nothing: it waits, for tf or for a pose of the CT that the body is cut out of, and `body_problem` says
  /// why when that is tf.
  std::string handOn(const std_msgs::Header& header, RegistrationPipeline* pipeline, std::string* body_problem);

 private:
  std::optional<RigidTransform> inCamera(const PoseRequest& request, const std_msgs::Header& header,
                                         std::string* why) const;

  const Transforms* transforms_;
  double tf_timeout_s_;
  std::map<std::string, PoseRequest> requests_;  ///< By the body's name; the CT's has none and so stands first.
};

}  // namespace xray_registration

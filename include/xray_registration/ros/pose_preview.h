#pragma once

#include <image_transport/publisher.h>
#include <ros/node_handle.h>
#include <std_msgs/Header.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/pipeline/registration_pipeline.h"

namespace xray_registration {

/// A pose that somebody tries out.
struct PreviewRequest {
  RigidTransform T_camera_object = RigidTransform::Identity();  ///< In the first view's camera.
  std::string body;                                             ///< Empty: of the CT.
  bool coarse = true;  ///< While it moves: at most 256 pixels a side, else 512.
};

/// Pictures of a pose that nobody has registered, over an X-ray: ~preview has the DRR's edges in orange, ~preview_drr
/// the DRR; with views ~<view>/preview and ~<view>/preview_drr. Topics of their own: ~overlay and ~drr are for results,
/// and would be taken for one. The worker thread's own but for the constructor.
class PosePreview {
 public:
  PosePreview(const ros::NodeHandle& private_node, const NodeParameters& parameters);

  /// Where the CT and the bodies were last accepted.
  void takeResult(const RegistrationResult& result);
  void forgetPoses() { last_.clear(); }

  /// Whether somebody looks.
  bool isWanted() const;

  /// Draws and publishes. `headers` are those of the views' images.
  void show(const PreviewRequest& request, const std::vector<std::optional<ViewInput>>& views,
            const std::vector<std_msgs::Header>& headers, RegistrationPipeline* pipeline);

 private:
  RegistrationResult posed(const PreviewRequest& request, const RegistrationPipeline& pipeline) const;
  const ViewInput& smaller(std::size_t view, const ViewInput& input, int longest_side);

  /// A view made smaller, kept while its X-ray is the newest.
  struct Smaller {
    std::shared_ptr<const XrayFrame> of;
    int longest_side = 0;
    std::optional<ViewInput> view;
  };

  std::vector<BodyParameters> bodies_;
  std::string drr_encoding_;
  std::vector<image_transport::Publisher> overlays_;
  std::vector<image_transport::Publisher> drrs_;
  std::vector<Smaller> smaller_;
  std::map<std::string, RigidTransform> last_;  ///< By the body's name; the CT has none.
};

}  // namespace xray_registration

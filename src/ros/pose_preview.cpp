#include "xray_registration/ros/pose_preview.h"

#include <image_transport/image_transport.h>

#include <algorithm>

#include "xray_registration/image/image_pyramid.h"
#include "xray_registration/pipeline/drr_parts.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

// Pixels: drawn several times as often as ten times a second, and without keeping the frames waiting.
constexpr int kCoarseSide = 256;
constexpr int kFineSide = 512;
constexpr Rgb kPreviewColour = {255, 140, 0};  // Neither accepted, nor refused, nor a body's.

bool isLookedAt(const std::vector<image_transport::Publisher>& publishers) {
  return std::any_of(publishers.begin(), publishers.end(),
                     [](const image_transport::Publisher& publisher) { return publisher.getNumSubscribers() > 0; });
}

void publish(const image_transport::Publisher& publisher, const std_msgs::Header& header, sensor_msgs::Image message) {
  message.header = header;
  message.header.frame_id = tfFrame(header.frame_id);
  publisher.publish(message);
}

}  // namespace

PosePreview::PosePreview(const ros::NodeHandle& private_node, const NodeParameters& parameters)
    : bodies_(parameters.bodies), drr_encoding_(parameters.drr_encoding) {
  image_transport::ImageTransport transport(private_node);
  for (const std::string& view : parameters.viewNames()) {
    const std::string prefix = view.empty() ? "" : view + "/";
    overlays_.push_back(transport.advertise(prefix + "preview", 1));
    drrs_.push_back(transport.advertise(prefix + "preview_drr", 1));
  }
  smaller_.resize(overlays_.size());
}

void PosePreview::takeResult(const RegistrationResult& result) {
  if (result.accepted) last_[""] = result.T_camera_ct;
  for (const BodyResult& body : result.bodies) {
    if (body.accepted) last_[body.name] = body.T_camera_body;
  }
}

bool PosePreview::isWanted() const { return isLookedAt(overlays_) || isLookedAt(drrs_); }

/// As if the pose had been found. Bodies of the CT go with it where the CT is moved, as they start where it has them.
RegistrationResult PosePreview::posed(const PreviewRequest& request, const RegistrationPipeline& pipeline) const {
  RegistrationResult result;
  result.accepted = result.solved = true;
  const auto known = last_.find("");
  const bool moves_ct = request.body.empty();
  result.T_camera_ct = moves_ct || known == last_.end() ? request.T_camera_object : known->second;
  for (const FollowedBodyInfo& info : pipeline.followedBodies()) {
    BodyResult body;
    body.name = info.name;
    body.centre_ct_mm = info.centre_mm;
    const auto last = last_.find(info.name);
    const bool goes_with_ct = info.cut_from_ct && (moves_ct || last == last_.end());
    body.accepted = body.solved = info.name == request.body || goes_with_ct || last != last_.end();
    if (info.name == request.body) {
      body.T_camera_body = request.T_camera_object;
    } else if (body.solved) {
      body.T_camera_body = goes_with_ct ? result.T_camera_ct : last->second;
    }
    result.bodies.push_back(std::move(body));
  }
  return result;
}

const ViewInput& PosePreview::smaller(std::size_t view, const ViewInput& input, int longest_side) {
  Smaller& kept = smaller_[view];
  if (kept.of == input.xray && kept.longest_side == longest_side) return *kept.view;
  const XrayFrame& fine = *input.xray;
  const int factor = (std::max(fine.camera.width, fine.camera.height) + longest_side - 1) / longest_side;
  kept.view.emplace(std::make_shared<const XrayFrame>(binned(fine, factor)), input.T_view_first);
  kept.of = input.xray;
  kept.longest_side = longest_side;
  return *kept.view;
}

void PosePreview::show(const PreviewRequest& request, const std::vector<std::optional<ViewInput>>& views,
                       const std::vector<std_msgs::Header>& headers, RegistrationPipeline* pipeline) {
  const RegistrationResult result = posed(request, *pipeline);
  for (std::size_t i = 0; i < views.size() && i < overlays_.size(); ++i) {
    const bool wants_overlay = overlays_[i].getNumSubscribers() > 0;
    const bool wants_drr = drrs_[i].getNumSubscribers() > 0;
    if (!views[i] || !(wants_overlay || wants_drr)) continue;
    const ViewInput& view = smaller(i, *views[i], request.coarse ? kCoarseSide : kFineSide);
    const DrrParts parts = pipeline->renderParts(view, result);
    const FloatImage drr = wants_drr ? acceptedDrr(parts, result) : FloatImage();
    if (!drr.empty()) {
      publish(drrs_[i], headers[i], drr_encoding_ == "32FC1" ? toFloatMessage(drr) : toDisplayMessage(drr));
    }
    if (!wants_overlay) continue;
    std::vector<OverlayLine> lines = overlayLines(parts, result, bodies_);
    for (OverlayLine& line : lines) {
      if (!line.outline) line.colour = kPreviewColour;
    }
    publish(overlays_[i], headers[i],
            toColourMessage(drawOverlay(view.xray->attenuation.values(), view.xray->mask, lines)));
  }
}

}  // namespace xray_registration

#include "clicked_points.h"

#include <algorithm>
#include <utility>

namespace xray_registration {

void ClickedPoints::addPoint(const Eigen::Vector3d& point_ct) {
  if (!landmarks_.empty() && landmarks_.back().pixels.empty()) landmarks_.pop_back();
  landmarks_.push_back({point_ct, std::exchange(waiting_, {})});
}

void ClickedPoints::addPixel(const std::string& view, const Eigen::Vector2d& pixel) {
  const auto is_of_view = [&](const Pixel& known) { return known.view == view; };
  if (!landmarks_.empty()) {
    std::vector<Pixel>& pixels = landmarks_.back().pixels;
    if (std::none_of(pixels.begin(), pixels.end(), is_of_view)) {
      pixels.push_back({view, pixel, {}});
      return;
    }
  }
  waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), is_of_view), waiting_.end());
  waiting_.push_back({view, pixel, {}});
}

void ClickedPoints::takeBack() {
  if (!waiting_.empty()) {
    waiting_.pop_back();
  } else if (!landmarks_.empty()) {
    landmarks_.pop_back();
  }
}

void ClickedPoints::clear() {
  landmarks_.clear();
  waiting_.clear();
}

std::vector<SeenPoint> ClickedPoints::seen() const {
  std::vector<SeenPoint> all;
  for (const Clicked& landmark : landmarks_) {
    for (const Pixel& pixel : landmark.pixels) all.push_back({landmark.point_ct, pixel.at, pixel.view});
  }
  return all;
}

std::size_t ClickedPoints::pairCount() const { return seen().size(); }

void ClickedPoints::judge(const std::vector<bool>& agrees) {
  std::size_t i = 0;
  for (Clicked& landmark : landmarks_) {
    for (Pixel& pixel : landmark.pixels) {
      pixel.agrees = i < agrees.size() ? std::optional<bool>(agrees[i]) : std::nullopt;
      ++i;
    }
  }
}

std::vector<ShownLandmark> ClickedPoints::shown() const {
  using State = ShownLandmark::State;
  std::vector<ShownLandmark> all;
  for (const Clicked& landmark : landmarks_) {
    State state = landmark.pixels.empty() ? State::kWaiting : State::kPaired;
    for (const Pixel& pixel : landmark.pixels) {
      if (pixel.agrees && state != State::kLeftOut) state = *pixel.agrees ? State::kAgrees : State::kLeftOut;
    }
    all.push_back({landmark.point_ct, state});
  }
  return all;
}

std::string ClickedPoints::inWords() const {
  const std::size_t pairs = pairCount();
  std::string text = std::to_string(pairs) + (pairs == 1 ? " landmark" : " landmarks");
  if (!landmarks_.empty() && landmarks_.back().pixels.empty()) text += "; the last point waits for its pixel";
  if (!waiting_.empty()) text += "; a pixel waits for its point";
  return text;
}

}  // namespace xray_registration

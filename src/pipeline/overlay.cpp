#include "xray_registration/pipeline/overlay.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <vector>

#include "xray_registration/common/statistics.h"

namespace xray_registration {

namespace {

// OpenCV's matrices do not know const; the views below are only read.
cv::Mat viewOf(const FloatImage& image) {
  return {image.height, image.width, CV_32FC1, const_cast<float*>(image.pixels.data())};
}
cv::Mat viewOf(const MaskImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

/// Grey values from the pixels in use, so that a collimator or an instrument does not darken the picture.
cv::Mat greyOf(const FloatImage& attenuation, const MaskImage& mask) {
  std::vector<float> used;
  used.reserve(attenuation.pixels.size());
  for (std::size_t i = 0; i < attenuation.pixels.size(); ++i) {
    if (mask.empty() || mask.pixels[i] != 0) used.push_back(attenuation.pixels[i]);
  }
  const double low = used.empty() ? 0.0 : quantileBelow(&used, 0.01);
  const double high = used.empty() ? 0.0 : quantileBelow(&used, 0.99);
  const double scale = high > low ? 255.0 / (high - low) : 0.0;
  cv::Mat grey;
  viewOf(attenuation).convertTo(grey, CV_8UC1, scale, -low * scale);
  return grey;
}

/// Pixels on the DRR's strongest edges, one pixel wide.
cv::Mat edgesOf(const FloatImage& drr) {
  cv::Mat smooth;
  cv::GaussianBlur(viewOf(drr), smooth, cv::Size(), 1.0);
  double low = 0.0;
  double high = 0.0;
  cv::minMaxLoc(smooth, &low, &high);
  cv::Mat grey;
  const double scale = high > low ? 255.0 / (high - low) : 0.0;
  smooth.convertTo(grey, CV_8UC1, scale, -low * scale);
  cv::Mat edges;
  cv::Canny(grey, edges, 20.0, 50.0, 3, true);
  return edges;
}

/// By stripes that neither rows, nor columns, nor diagonals follow: there a line would vanish, or look whole.
void makeDashed(cv::Mat* edges) {
  constexpr int kStripe = 8;
  for (int v = 0; v < edges->rows; ++v) {
    for (int u = 0; u < edges->cols; ++u) {
      if ((2 * u + v) / kStripe % 2 != 0) edges->at<std::uint8_t>(v, u) = 0;
    }
  }
}

void drawLine(const OverlayLine& line, cv::Mat* picture) {
  cv::Mat edges = edgesOf(*line.drr);
  if (line.dashed) makeDashed(&edges);
  picture->setTo(cv::Scalar(line.colour[0], line.colour[1], line.colour[2]), edges);
}

/// The X-ray, and what its mask leaves out.
void drawXray(const FloatImage& attenuation, const MaskImage& mask, cv::Mat* picture) {
  cv::cvtColor(greyOf(attenuation, mask), *picture, cv::COLOR_GRAY2RGB);
  if (mask.empty()) return;
  const cv::Mat left_out = viewOf(mask) == 0;
  cv::Mat tinted;
  cv::addWeighted(*picture, 0.6, cv::Mat(picture->size(), CV_8UC3, cv::Scalar(30, 60, 255)), 0.4, 0.0, tinted);
  tinted.copyTo(*picture, left_out);
}

template <typename Other>
bool differs(const Other& other, const FloatImage& attenuation) {
  return other.width != attenuation.width || other.height != attenuation.height;
}

}  // namespace

Rgb bodyColour(std::size_t body) {
  constexpr std::array<Rgb, 5> kColours = {
      {{255, 215, 0}, {0, 225, 255}, {255, 90, 255}, {185, 140, 255}, {255, 180, 110}}};
  return kColours[body % kColours.size()];
}

RgbImage drawOverlay(const FloatImage& attenuation, const MaskImage& mask, const std::vector<OverlayLine>& lines) {
  const bool fits = !attenuation.empty() && (mask.empty() || !differs(mask, attenuation)) &&
                    std::none_of(lines.begin(), lines.end(),
                                 [&](const OverlayLine& line) { return differs(*line.drr, attenuation); });
  if (!fits) throw std::invalid_argument("an overlay needs an X-ray, and a mask and a DRR of its size");
  static_assert(sizeof(Rgb) == 3, "OpenCV writes into it");
  RgbImage result(attenuation.width, attenuation.height);
  cv::Mat picture(attenuation.height, attenuation.width, CV_8UC3, result.pixels.data());
  drawXray(attenuation, mask, &picture);
  for (const OverlayLine& line : lines) drawLine(line, &picture);
  return result;
}

RgbImage drawOverlay(const FloatImage& attenuation, const MaskImage& mask, const FloatImage& drr,
                     OverlayColour colour) {
  std::vector<OverlayLine> lines;
  if (!drr.empty()) lines.push_back({&drr, colour == OverlayColour::kAccepted ? kAcceptedColour : kRefusedColour});
  return drawOverlay(attenuation, mask, lines);
}

}  // namespace xray_registration

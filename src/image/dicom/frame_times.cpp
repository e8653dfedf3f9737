#include "image/dicom/frame_times.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "image/dicom/tags.h"

namespace xray_registration::dicom {
namespace {

constexpr double kSecondsPerDay = 86400.0;
constexpr std::size_t kDateDigits = 8;  // Of "YYYYMMDDHHMMSS.FFFFFF+ZZZZ".

/// The time of day of an instant; dates are not looked at, so that none can get out.
std::optional<double> timeOf(const std::string& instant) {
  if (instant.size() <= kDateDigits) return std::nullopt;
  return secondsOfDay(instant.substr(kDateDigits, instant.find_first_of("+-") - kDateDigits));
}

bool setFromInstants(const DataSet& file, DicomHeader* header) {
  std::vector<double> instants;
  for (std::size_t i = 0; i < header->frames.size(); ++i) {
    const auto instant = timeOf(Scopes(file, i).word(tag::kFrameAcquisitionDateTime));
    if (!instant) return false;
    instants.push_back(*instant);
    // Past midnight.
    if (i > 0 && instants[i] < instants[i - 1]) {
      instants[i] += kSecondsPerDay * std::ceil((instants[i - 1] - instants[i]) / kSecondsPerDay);
    }
  }
  for (std::size_t i = 0; i < instants.size(); ++i) header->frames[i].time_s = instants[i] - instants[0];
  return instants.size() > 1 && instants.back() > instants.front();
}

bool setFromSteps(const std::vector<double>& steps_ms, DicomHeader* header) {
  if (steps_ms.size() < header->frames.size() || header->frames.size() < 2) return false;
  double time_ms = 0.0;
  for (std::size_t i = 1; i < header->frames.size(); ++i) {
    if (!(steps_ms[i] > 0.0)) return false;
    time_ms += steps_ms[i];
    header->frames[i].time_s = time_ms / 1000.0;
  }
  return true;
}

bool setFromPeriod(std::optional<double> period_s, DicomHeader* header) {
  if (!period_s || !(*period_s > 0.0)) return false;
  for (std::size_t i = 0; i < header->frames.size(); ++i) header->frames[i].time_s = static_cast<double>(i) * *period_s;
  return true;
}

std::optional<double> scaled(std::optional<double> value, double factor) {
  return value ? std::optional<double>(*value * factor) : std::nullopt;
}

std::optional<double> inverse(std::optional<double> value) {
  return value && *value > 0.0 ? std::optional<double>(1.0 / *value) : std::nullopt;
}

}  // namespace

std::optional<double> secondsOfDay(const std::string& time) {
  std::string digits;
  for (const char c : time) {
    if (c == ':') continue;  // As old files write it.
    digits += c;
  }
  const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  const std::size_t whole = std::min(digits.find('.'), digits.size());
  if (whole < 2 || whole > 6 || whole % 2 != 0) return std::nullopt;
  if (!std::all_of(digits.begin(), digits.begin() + static_cast<std::ptrdiff_t>(whole), is_digit)) return std::nullopt;
  double seconds = 3600.0 * std::stoi(digits.substr(0, 2));
  if (whole >= 4) seconds += 60.0 * std::stoi(digits.substr(2, 2));
  if (whole >= 6) seconds += std::stoi(digits.substr(4, 2));
  // Nanoseconds at most: what a double cannot hold is an exception of std::stod.
  const std::string fraction = whole < digits.size() ? digits.substr(whole + 1, 9) : "";
  if (!fraction.empty() && std::all_of(fraction.begin(), fraction.end(), is_digit))
    seconds += std::stod("0." + fraction);
  return seconds;
}

void setFrameTimes(const DataSet& file, DicomHeader* header) {
  const Scopes scopes(file);
  const auto from = [header](const char* name, Tag tag) {
    header->time_source = std::string(name) + " " + inWords(tag);
  };
  if (setFromInstants(file, header)) {
    from("FrameAcquisitionDateTime", tag::kFrameAcquisitionDateTime);
  } else if (setFromSteps(scopes.numbers(tag::kFrameTimeVector), header)) {
    from("FrameTimeVector", tag::kFrameTimeVector);
  } else if (setFromPeriod(scaled(scopes.number(tag::kFrameTime), 1e-3), header)) {
    from("FrameTime", tag::kFrameTime);
  } else if (setFromPeriod(inverse(scopes.number(tag::kCineRate)), header)) {
    from("CineRate", tag::kCineRate);
  } else if (setFromPeriod(inverse(scopes.number(tag::kRecommendedDisplayFrameRate)), header)) {
    from("RecommendedDisplayFrameRate", tag::kRecommendedDisplayFrameRate);
  }
}

}  // namespace xray_registration::dicom

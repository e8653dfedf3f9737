#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace xray_registration {

/// Which CT the parameter initial_pose is for: a pose means something with one CT alone, whose frame it is. It is
/// ct/path, and where that is empty the first CT that ~load_ct brings. That CT is met again at the pose each time that
/// it is loaded; another one is not. Not thread-safe.
class InitialPoseScope {
 public:
  /// `path`: ct/path, may be empty; `series_uid`: ct/series_uid.
  InitialPoseScope(const std::string& path, std::string series_uid) : default_series_uid_(std::move(series_uid)) {
    if (!path.empty()) owner_ = key(path, "");
  }

  /// To be told of every CT that was loaded; whether the initial pose is for it.
  bool covers(const std::string& path, const std::string& series_uid) {
    const Key loaded = key(path, series_uid);
    if (!owner_) owner_ = loaded;
    return *owner_ == loaded;
  }

 private:
  using Key = std::pair<std::string, std::string>;

  Key key(const std::string& path, const std::string& series_uid) const {
    std::error_code ignored;  // Then the path as it was given.
    std::filesystem::path real = std::filesystem::weakly_canonical(path, ignored);
    if (!real.has_filename()) real = real.parent_path();  // "folder/"
    return {ignored ? path : real.string(), series_uid.empty() ? default_series_uid_ : series_uid};
  }

  std::string default_series_uid_;
  std::optional<Key> owner_;
};

}  // namespace xray_registration

#pragma once

#include <interactive_markers/menu_handler.h>

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace xray_registration {

/// The menu of ~ct_marker: what is moved, what is shown, landmarks, the wide search, reset. Actions are called on the
/// marker server's thread.
class MarkerMenu {
 public:
  struct Actions {
    std::function<void(const std::string& object)> select;
    std::function<void(const std::string& object)> show;  ///< Or hide.
    std::function<void()> use_landmarks;
    std::function<void()> take_back_landmark;
    std::function<void()> clear_landmarks;
    std::function<void()> localize_here;
    std::function<void()> localize_anywhere;
    std::function<void()> reset;
  };

  /// `objects`: names of bodies; the CT has none and stands first.
  MarkerMenu(const std::vector<std::string>& objects, Actions actions);

  void applyTo(interactive_markers::InteractiveMarkerServer* server, const std::string& marker);
  void mark(interactive_markers::InteractiveMarkerServer* server, const std::string& selected,
            const std::set<std::string>& hidden);

 private:
  using Handle = interactive_markers::MenuHandler::EntryHandle;
  void addObjects(const std::vector<std::string>& objects);

  Actions actions_;
  interactive_markers::MenuHandler menu_;
  std::map<std::string, Handle> moved_;
  std::map<std::string, Handle> shown_;
};

}  // namespace xray_registration

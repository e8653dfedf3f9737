#include "marker_menu.h"

#include <interactive_markers/interactive_marker_server.h>

#include <utility>

namespace xray_registration {

using interactive_markers::MenuHandler;
using Feedback = visualization_msgs::InteractiveMarkerFeedbackConstPtr;

MarkerMenu::MarkerMenu(const std::vector<std::string>& objects, Actions actions) : actions_(std::move(actions)) {
  addObjects(objects);
  const auto entry = [this](Handle parent, const std::string& title, const std::function<void()>& action) {
    menu_.insert(parent, title, [action](const Feedback&) { action(); });
  };
  const Handle landmarks = menu_.insert("Landmarks");
  entry(landmarks, "Use their pose", actions_.use_landmarks);
  entry(landmarks, "Take back the last click", actions_.take_back_landmark);
  entry(landmarks, "Clear", actions_.clear_landmarks);
  const Handle localize = menu_.insert("Localize");
  entry(localize, "Around here", actions_.localize_here);
  entry(localize, "Anywhere", actions_.localize_anywhere);
  menu_.insert("Reset", [this](const Feedback&) { actions_.reset(); });
}

void MarkerMenu::addObjects(const std::vector<std::string>& objects) {
  const Handle move = menu_.insert("Move");
  const Handle show = menu_.insert("Show");
  for (const std::string& object : objects) {
    const std::string title = object.empty() ? "CT" : object;
    const Handle moved = menu_.insert(move, title, [this, object](const Feedback&) { actions_.select(object); });
    menu_.setCheckState(moved, moved_.empty() ? MenuHandler::CHECKED : MenuHandler::UNCHECKED);
    moved_[object] = moved;
    const Handle shown = menu_.insert(show, title, [this, object](const Feedback&) { actions_.show(object); });
    menu_.setCheckState(shown, MenuHandler::CHECKED);
    shown_[object] = shown;
  }
}

void MarkerMenu::applyTo(interactive_markers::InteractiveMarkerServer* server, const std::string& marker) {
  menu_.apply(*server, marker);
}

void MarkerMenu::mark(interactive_markers::InteractiveMarkerServer* server, const std::string& selected,
                      const std::set<std::string>& hidden) {
  const auto check = [this](Handle handle, bool checked) {
    menu_.setCheckState(handle, checked ? MenuHandler::CHECKED : MenuHandler::UNCHECKED);
  };
  for (const auto& [name, handle] : moved_) check(handle, name == selected);
  for (const auto& [name, handle] : shown_) check(handle, hidden.count(name) == 0);
  menu_.reApply(*server);
}

}  // namespace xray_registration

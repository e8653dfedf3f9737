#pragma once

#include <optional>
#include <string>

namespace xray_registration {

/// What is wrong with a bag, in words that go on after the file's name, or nothing. rosbag follows the lengths and
/// places that a bag states without a look: it reads beyond its memory, or takes as much as a number claims. Only bags
/// that pass may be handed to it. Every record has to lie within the file, every chunk to unpack to what it says, and
/// every place in the index to be a message's. Bags without an index and files that are no bag pass: rosbag refuses
/// those itself. Reads the whole file. Any thread.
/// The format: http://wiki.ros.org/Bags/Format/2.0.
std::optional<std::string> bagDamage(const std::string& path);

}  // namespace xray_registration

#pragma once

#include <exception>
#include <new>
#include <string>

namespace xray_registration {

/// An exception for people: what the standard library says of missing memory is a name in its own code.
inline std::string inWords(const std::exception& error) {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ? "out of memory" : error.what();
}

}  // namespace xray_registration

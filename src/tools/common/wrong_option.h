#pragma once

#include <string>
#include <vector>

#include "tools/common/command_line.h"
#include "xray_registration/evaluation/wrong_input.h"

namespace xray_registration::tools {

/// --wrong, with its kinds in the help.
void addWrongOption(CLI::App* app, std::vector<std::string>* texts);

/// @throws ArgumentError for a text that says nothing usable.
std::vector<WrongInput> wrongInputs(const std::vector<std::string>& texts);

/// @throws ArgumentError for a view that is not there.
void tellWrongViews(const std::vector<WrongInput>& wrong, std::vector<RawView>* views);

}  // namespace xray_registration::tools

#include "tools/common/wrong_option.h"

#include <stdexcept>

namespace xray_registration::tools {
namespace {

template <typename Work>
void withArgumentWrong(const Work& work) {
  try {
    work();
  } catch (const std::invalid_argument& error) {
    throw ArgumentError(std::string("--wrong: ") + error.what());
  }
}

}  // namespace

void addWrongOption(CLI::App* app, std::vector<std::string>* texts) {
  app->add_option("--wrong", *texts,
                  "tell the registration something wrong, one of the kinds below; repeatable, applied in this order")
      ->allow_extra_args(false);
  app->footer("Kinds of --wrong; errors are measured against the recorded pose all the same:\n" + wrongInputKinds());
}

std::vector<WrongInput> wrongInputs(const std::vector<std::string>& texts) {
  std::vector<WrongInput> wrong;
  withArgumentWrong([&] {
    for (const std::string& text : texts) wrong.push_back(parseWrongInput(text));
  });
  return wrong;
}

void tellWrongViews(const std::vector<WrongInput>& wrong, std::vector<RawView>* views) {
  withArgumentWrong([&] { tellWrong(wrong, views); });
}

}  // namespace xray_registration::tools

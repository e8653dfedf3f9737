#include "xray_registration/common/itk_quiet.h"

#include <gdcmTrace.h>
#include <itkObject.h>

#include <sstream>

namespace xray_registration {

struct QuietItk::State {
  bool itk = itk::Object::GetGlobalWarningDisplay();
  bool gdcm = gdcm::Trace::GetWarningFlag();
  std::ostream& stream = gdcm::Trace::GetStream();
  std::ostringstream said;
};

QuietItk::QuietItk() : state_(std::make_unique<State>()) {
  itk::Object::SetGlobalWarningDisplay(false);
  gdcm::Trace::SetStream(state_->said);
  gdcm::Trace::WarningOn();
}

QuietItk::~QuietItk() {
  itk::Object::SetGlobalWarningDisplay(state_->itk);
  gdcm::Trace::SetStream(state_->stream);
  gdcm::Trace::SetWarning(state_->gdcm);
}

bool QuietItk::pixelsWereIncomplete() const {
  return state_->said.str().find("Incomplete Pixel Data") != std::string::npos;
}

}  // namespace xray_registration

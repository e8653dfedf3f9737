# What the compiler says about this package's own code: every target links this one. It warns by itself; as errors only
# where XRAY_REGISTRATION_WERROR says so, since another compiler may know warnings that this code was never built with.
add_library(xray_registration_warnings INTERFACE)
target_compile_options(xray_registration_warnings INTERFACE -Wall -Wextra)
if(XRAY_REGISTRATION_WERROR)
  target_compile_options(xray_registration_warnings INTERFACE -Werror)
endif()

# XRAY_REGISTRATION_SANITIZE: everything that is built carries the sanitizers, since one library without them hides what
# happens in it. Suppressions and how a run is read: scripts/test, test/sanitizers.
# -O1 keeps the stacks of a report readable and the tests within their time. No NDEBUG: Eigen's and the library's
# assertions are part of the net.
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")
add_compile_options(-fsanitize=${XRAY_REGISTRATION_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=undefined)
add_link_options(-fsanitize=${XRAY_REGISTRATION_SANITIZE})
# GCC 12 takes members of std::regex for uninitialised once the sanitizers have split its code (its bug 105616); the
# normal build keeps this warning.
add_compile_options(-Wno-maybe-uninitialized)

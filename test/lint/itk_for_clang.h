#pragma once

// Included before everything when clang-tidy reads a file. ITK's generated header knows only the compilers that ITK was
// packaged for (on Debian GCC, 4.4 at least) and ends any other with "Unsupported compiler". clang knows all that the
// header asks a GCC for, so it is read once as GCC 12; its own include guard keeps it from being read again.
#if defined(__clang__) && defined(__has_include)
#if __has_include(<itk_compiler_detection.h>)
#pragma push_macro("__clang__")
#pragma push_macro("__GNUC__")
#undef __clang__
#undef __GNUC__
#define __GNUC__ 12
#include <itk_compiler_detection.h>
#pragma pop_macro("__GNUC__")
#pragma pop_macro("__clang__")
#endif
#endif

# The tools `benchmark` and `kernel_benchmark` as a user runs them: every row is there. No time is judged.
if(TARGET benchmark)
  find_package(Python3 COMPONENTS Interpreter QUIET)
  set(work ${CMAKE_CURRENT_BINARY_DIR}/test_work/benchmark)
  set(has "")
  if(XRAY_REGISTRATION_ROS)
    list(APPEND has bags)
  endif()
  if(TARGET kernel_benchmark)
    list(APPEND has kernels)
  endif()
  # The interpreter is named by the script's first line; a bare machine may have its Python elsewhere.
  add_test(NAME tools.benchmark
           COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/benchmark_test.py
                   --tools $<TARGET_FILE_DIR:benchmark> --work ${work} --has "${has}")
  xray_test_limits(tools.benchmark 600)
endif()

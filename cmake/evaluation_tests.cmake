# The tool `evaluate` as a user runs it: on a simulated session always, on the recorded ones when XRAY_REGISTRATION_DATA
# names their folder (else the test counts as skipped and says why).
if(NOT TARGET evaluate)
  return()
endif()
foreach(kind simulated recorded)
  set(work ${CMAKE_CURRENT_BINARY_DIR}/test_work/evaluate_${kind})
  add_test(NAME tools.evaluate_${kind}
           COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/evaluate_test.py ${kind}
                   --tools $<TARGET_FILE_DIR:evaluate> --work ${work})
  xray_test_limits(tools.evaluate_${kind} 600)
  set_tests_properties(tools.evaluate_${kind} PROPERTIES SKIP_RETURN_CODE 77)
endforeach()

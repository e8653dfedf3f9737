# The tools `evaluate` and `register_bag` as a user runs them: on simulated sessions always, on the recorded ones when
# XRAY_REGISTRATION_DATA names their folder (else the test counts as skipped and says why).
if(NOT TARGET evaluate)
  return()
endif()
foreach(tool evaluate register_bag)
  foreach(kind simulated recorded)
    set(work ${CMAKE_CURRENT_BINARY_DIR}/test_work/${tool}_${kind})
    add_test(NAME tools.${tool}_${kind}
             COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/${tool}_test.py ${kind}
                     --tools $<TARGET_FILE_DIR:${tool}> --work ${work})
    xray_test_limits(tools.${tool}_${kind} 600)
    set_tests_properties(tools.${tool}_${kind} PROPERTIES SKIP_RETURN_CODE 77)
  endforeach()
endforeach()

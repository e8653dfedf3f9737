# The tool `evaluate` as a user runs it: on a simulated session always, on the recorded ones when XRAY_REGISTRATION_DATA
# names their folder (else the test counts as skipped and says why).
foreach(kind simulated recorded)
  set(work ${CMAKE_CURRENT_BINARY_DIR}/test_work/evaluate_${kind})
  file(MAKE_DIRECTORY ${work}/pocl_cache)
  add_test(NAME tools.evaluate_${kind}
           COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/evaluate_test.py ${kind}
                   --tools $<TARGET_FILE_DIR:evaluate> --work ${work})
  set_tests_properties(tools.evaluate_${kind} PROPERTIES
    ENVIRONMENT "POCL_CACHE_DIR=${work}/pocl_cache" SKIP_RETURN_CODE 77 TIMEOUT 600)
endforeach()

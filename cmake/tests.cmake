find_package(GTest REQUIRED)

# Not where rosrun looks, whose list is the tools' alone.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/test)

# xray_test_limits(<test> <seconds>): its time, and a kernel cache of its own: PoCL's is not safe against another process
# that writes it.
function(xray_test_limits test seconds)
  set(cache ${CMAKE_CURRENT_BINARY_DIR}/pocl_cache/${test})
  file(MAKE_DIRECTORY ${cache})
  set_tests_properties(${test} PROPERTIES ENVIRONMENT "POCL_CACHE_DIR=${cache}" TIMEOUT ${seconds})
endfunction()

# xray_test(<room> <name> <file>): one test's file against the room and those below it. Named test_<room>_<name>.
function(xray_test room name file)
  cmake_parse_arguments(TEST "" "" "ROOMS" ${ARGN})
  set(target test_${room}_${name})
  add_executable(${target} ${file})
  target_link_libraries(${target} PRIVATE xray_registration_warnings)
  target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_compile_definitions(${target} PRIVATE XRAY_REGISTRATION_SOURCE="${CMAKE_CURRENT_SOURCE_DIR}")
  xray_link_rooms(${target} ${room} ${TEST_ROOMS})
  if(name IN_LIST XRAY_DICOM_TESTS)
    target_include_directories(${target} SYSTEM PRIVATE ${GDCM_INCLUDE_DIR})
  endif()
  target_link_libraries(${target} PRIVATE GTest::GTest GTest::Main Threads::Threads)
  add_test(NAME ${room}.${name} COMMAND ${target})
  xray_test_limits(${room}.${name} 300)
endfunction()

# Tests mirror src/: each file test/<room>/<name>_test.cpp is one, in the room's folders as well.
function(xray_tests_of room)
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/test/${room}/*_test.cpp
       ${CMAKE_CURRENT_SOURCE_DIR}/test/${room}/*/*_test.cpp)
  foreach(file IN LISTS files)
    get_filename_component(name ${file} NAME_WE)
    string(REGEX REPLACE "_test$" "" name ${name})
    set(rooms ${ARGN})
    if(XRAY_REGISTRATION_COMPUTE_ONLY AND
       (name IN_LIST XRAY_FULL_CORE_TESTS OR name IN_LIST XRAY_DICOM_TESTS OR name STREQUAL yaml_file))
      continue()
    endif()
    if(name STREQUAL yaml_file)
      list(APPEND rooms common_yaml)
    endif()
    if(name IN_LIST XRAY_FULL_CORE_TESTS)
      list(APPEND rooms volume_itk image_opencv)
    endif()
    if(name IN_LIST XRAY_DICOM_TESTS)
      list(APPEND rooms image_dicom)
    endif()
    if(name STREQUAL trials OR name STREQUAL wrong_input)
      list(APPEND rooms evaluation_trials)
    endif()
    xray_test(${room} ${name} ${file} ROOMS ${rooms})
  endforeach()
endfunction()

# Tests that need ITK or OpenCV, and those of what stands on the pipeline.
set(XRAY_FULL_CORE_TESTS volume_io impossible_files nifti_files nrrd_meta_files dicom_values hu_values hard_cts segment_names bone_surface xray_frame mask undistortion_map calibration_grid xray_image_file
    undistorted_registration trials wrong_input landmark_pose landmark_place straight_pixel)
# Those of X-rays in DICOM (test/image/dicom).
set(XRAY_DICOM_TESTS dicom_geometry facts loop_x pixel_meaning positioner shutter_mask xray_dicom)

xray_tests_of(common)
xray_tests_of(geometry)
xray_tests_of(volume)
xray_tests_of(image)
xray_tests_of(drr)
xray_tests_of(registration evaluation)
xray_tests_of(evaluation)
if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  xray_tests_of(pipeline volume_itk image_opencv)
  # What docs/parameters.md is made of.
  add_executable(test_parameter_facts ${CMAKE_CURRENT_SOURCE_DIR}/test/pipeline/parameter_facts.cpp)
  target_link_libraries(test_parameter_facts PRIVATE xray_registration_warnings)
  xray_link_rooms(test_parameter_facts pipeline volume_itk image_opencv)
  add_test(NAME docs.parameters COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/scripts/parameters --check
           --facts $<TARGET_FILE:test_parameter_facts>)
  xray_test_limits(docs.parameters 60)
endif()
# A layer that fails calls, between these tests and OpenCL.
set(failing_opencl ${CMAKE_CURRENT_SOURCE_DIR}/test/drr/opencl/failing_opencl.cpp)
target_sources(test_drr_failing_calls PRIVATE ${failing_opencl})
target_link_libraries(test_drr_failing_calls PRIVATE ${CMAKE_DL_LIBS})
# 10 to 20 s each, and twenty times that under the thread sanitizer.
set_tests_properties(drr.failing_calls PROPERTIES TIMEOUT 900)
if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  target_sources(test_pipeline_failing_device PRIVATE ${failing_opencl})
  target_link_libraries(test_pipeline_failing_device PRIVATE ${CMAKE_DL_LIBS})
  set_tests_properties(pipeline.failing_device PROPERTIES TIMEOUT 900)
endif()
include(cmake/tools_tests.cmake)
include(cmake/benchmark_tests.cmake)
if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  include(cmake/fuzz_tests.cmake)
endif()
if(XRAY_REGISTRATION_ROS)
  include(cmake/ros_tests.cmake)
  include(cmake/evaluation_tests.cmake)
endif()

add_test(NAME architecture.rooms
         COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/architecture/check_rooms.sh ${CMAKE_CURRENT_SOURCE_DIR})
add_test(NAME architecture.private_headers
         COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/architecture/check_private_headers.py ${CMAKE_CURRENT_SOURCE_DIR})
add_test(NAME docs.troubleshooting COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/docs/troubleshooting_test.py)
# That the checks find what they are for.
add_test(NAME architecture.checks COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/architecture/architecture_test.py)

# Fuzzers of what we parse ourselves: test/fuzz/<name>_fuzz.cpp is one target, test/fuzz/<name>.dict its words if there
# are any, test/fuzz/corpus/<name> its seeds and findings.
set(fuzz_folder ${CMAKE_CURRENT_SOURCE_DIR}/test/fuzz)
set(fuzz_targets parameters camera_yaml pose_yaml landmarks undistortion_map segment_names nifti nrrd meta_image mesh
                 dicom_structure dicom_geometry dicom_file)
# Those of messages and bags.
set(fuzz_ros_targets image_message bag_session)
# What belongs to one tool alone.
set(fuzz_landmarks_sources
  ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/landmarks/csv_table.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/landmarks/points_file.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/landmarks/slicer_markups.cpp)

if(XRAY_REGISTRATION_FUZZ)
  include(cmake/fuzz_build.cmake)
  return()
endif()

# Without clang: the corpus, replayed.
foreach(name IN LISTS fuzz_targets fuzz_ros_targets)
  if(name IN_LIST fuzz_ros_targets AND NOT XRAY_REGISTRATION_ROS)
    continue()
  endif()
  set(target fuzz_replay_${name})
  add_executable(${target} ${fuzz_folder}/replay_test.cpp ${fuzz_folder}/fuzz_target.cpp ${fuzz_folder}/${name}_fuzz.cpp)
  target_link_libraries(${target} PRIVATE xray_registration_warnings)
  target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_compile_definitions(${target} PRIVATE XRAY_FUZZ_CORPUS="${fuzz_folder}/corpus/${name}")
  target_link_libraries(${target} PRIVATE xray_registration_tools_common GTest::GTest GTest::Main Threads::Threads)
  if(name STREQUAL landmarks)
    target_sources(${target} PRIVATE ${fuzz_landmarks_sources})
  endif()
  if(name IN_LIST fuzz_ros_targets)
    target_link_libraries(${target} PRIVATE xray_registration_ros)
  endif()
  # Not where rosrun looks.
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/test)
  add_test(NAME fuzz.${name} COMMAND ${target})
  xray_test_limits(fuzz.${name} 120)
endforeach()

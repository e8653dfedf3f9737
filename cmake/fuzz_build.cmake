# XRAY_REGISTRATION_FUZZ: nothing but the fuzzers, with clang's libFuzzer and all of ours under its sanitizers. Only the
# sources that they need: the readers, without device, solver and node. scripts/fuzz runs it.
if(NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
  message(FATAL_ERROR "libFuzzer comes with clang: -DCMAKE_CXX_COMPILER=clang++-14")
endif()
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(Threads REQUIRED)
find_package(ITK REQUIRED COMPONENTS
  ITKCommon ITKIOImageBase ITKIONIFTI ITKNrrdIO ITKIONRRD ITKIOMeta ITKIOGDCM ITKMesh)
find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs calib3d)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
if(NOT PYTHON_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The interpreter that catkin runs with")
endif()
find_package(catkin REQUIRED COMPONENTS
  cpp_common geometry_msgs rosbag roscpp_serialization rostime sensor_msgs tf2 tf2_msgs)
find_path(GDCM_INCLUDE_DIR gdcmTrace.h HINTS ${ITK_INCLUDE_DIRS} PATH_SUFFIXES gdcm-3.0 gdcm-2.8 REQUIRED)

# Conversions of numbers that do not fit are findings too. Libraries without sanitizers make objects that have no vptr
# that clang would know.
set(fuzz_sanitizers address,undefined,float-cast-overflow)
add_compile_options(-fsanitize=${fuzz_sanitizers} -fno-sanitize=vptr -fno-sanitize-recover=all -fno-omit-frame-pointer
                    -D_GLIBCXX_ASSERTIONS -Wall -Wextra)
add_link_options(-fsanitize=${fuzz_sanitizers})
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")

set(src ${CMAKE_CURRENT_SOURCE_DIR}/src)

# xray_fuzz_part(<name> SOURCES ... PARTS ... LIBRARIES ...): some of the sources, so that one target needs few of them.
function(xray_fuzz_part name)
  cmake_parse_arguments(PART "" "" "SOURCES;PARTS;LIBRARIES" ${ARGN})
  list(TRANSFORM PART_SOURCES PREPEND ${src}/)
  list(TRANSFORM PART_PARTS PREPEND fuzz_part_)
  add_library(fuzz_part_${name} STATIC ${PART_SOURCES})
  target_compile_options(fuzz_part_${name} PRIVATE -fsanitize=fuzzer-no-link)
  target_include_directories(fuzz_part_${name} PUBLIC
    ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/include ${src})
  target_link_libraries(fuzz_part_${name} PUBLIC ${PART_PARTS} ${PART_LIBRARIES})
endfunction()

xray_fuzz_part(base LIBRARIES Eigen3::Eigen Threads::Threads ${YAML_CPP_LIBRARIES}
  SOURCES common/escaped.cpp common/names.cpp common/statistics.cpp common/yaml_file.cpp common/dicom_structure.cpp
          geometry/rigid_transform.cpp geometry/xray_camera.cpp geometry/volume_grid.cpp volume/file_grid.cpp)
xray_fuzz_part(yaml PARTS base LIBRARIES ${YAML_CPP_LIBRARIES}
  SOURCES drr/similarity.cpp pipeline/parameters.cpp pipeline/body_parser.cpp pipeline/pose_yaml.cpp
          tools/common/yaml_files.cpp)
xray_fuzz_part(landmarks PARTS base LIBRARIES nlohmann_json::nlohmann_json
  SOURCES tools/landmarks/csv_table.cpp tools/landmarks/points_file.cpp tools/landmarks/slicer_markups.cpp)
xray_fuzz_part(image PARTS base LIBRARIES ${OpenCV_LIBS}
  SOURCES image/calibration.cpp image/xray_frame.cpp image/open_field.cpp image/mask.cpp image/mask_common.cpp
          image/field_mask.cpp image/letter_mask.cpp image/metal_mask.cpp image/polynomial_surface.cpp
          image/undistortion_map.cpp image/undistortion_map_file.cpp)
target_include_directories(fuzz_part_image SYSTEM PUBLIC ${OpenCV_INCLUDE_DIRS})
xray_fuzz_part(header PARTS base
  SOURCES volume/file_boundary.cpp volume/header_text.cpp volume/segment_names.cpp)
xray_fuzz_part(mesh PARTS header
  SOURCES volume/surface_mesh.cpp volume/mesh_ply.cpp volume/mesh_scanner.cpp volume/mesh_stl.cpp volume/mesh_vtk.cpp
          volume/mesh_repair.cpp)
xray_fuzz_part(gdcm PARTS base LIBRARIES ${ITK_LIBRARIES} gdcmMSFF gdcmDSED gdcmDICT gdcmIOD gdcmCommon
  SOURCES common/itk_quiet.cpp)
target_include_directories(fuzz_part_gdcm SYSTEM PUBLIC ${ITK_INCLUDE_DIRS} ${GDCM_INCLUDE_DIR})
xray_fuzz_part(volume PARTS header gdcm LIBRARIES z
  SOURCES volume/byte_stream.cpp volume/dicom_series.cpp volume/hu_check.cpp volume/hu_histogram.cpp
          volume/itk_dicom_file.cpp volume/itk_image_file.cpp volume/itk_nrrd_header.cpp volume/meta_image.cpp
          volume/nifti_file.cpp volume/nifti_header.cpp volume/padding.cpp volume/volume_io.cpp)
xray_fuzz_part(xray_dicom PARTS gdcm
  SOURCES image/dicom/data_set.cpp image/dicom/detector.cpp image/dicom/dicom_geometry.cpp image/dicom/facts.cpp
          image/dicom/frame_times.cpp image/dicom/gdcm_file.cpp image/dicom/loop_x.cpp image/dicom/pixel_meaning.cpp
          image/dicom/pixel_values.cpp image/dicom/positioner.cpp image/dicom/shutter_mask.cpp
          image/dicom/vendor_camera.cpp image/dicom/xray_dicom.cpp)
xray_fuzz_part(ros PARTS image LIBRARIES ${catkin_LIBRARIES} SOURCES ros/conversions.cpp ros/bag_session.cpp)
target_include_directories(fuzz_part_ros SYSTEM PUBLIC ${catkin_INCLUDE_DIRS})

# As for clang-tidy.
file(GLOB itk_sources ${src}/*/itk_*.cpp)
set_source_files_properties(${itk_sources} PROPERTIES
  COMPILE_OPTIONS "-include;${CMAKE_CURRENT_SOURCE_DIR}/test/lint/itk_for_clang.h")

# xray_fuzzers(<part> names...): targets that need this part.
function(xray_fuzzers part)
  foreach(name IN LISTS ARGN)
    add_executable(fuzz_${name} ${fuzz_folder}/${name}_fuzz.cpp ${fuzz_folder}/fuzz_target.cpp)
    target_compile_options(fuzz_${name} PRIVATE -fsanitize=fuzzer-no-link)
    target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
    target_link_libraries(fuzz_${name} PRIVATE fuzz_part_${part})
  endforeach()
endfunction()

xray_fuzzers(base dicom_structure)
xray_fuzzers(yaml parameters camera_yaml pose_yaml)
xray_fuzzers(landmarks landmarks)
xray_fuzzers(image undistortion_map)
xray_fuzzers(header segment_names)
xray_fuzzers(mesh mesh)
xray_fuzzers(volume nifti nrrd meta_image dicom_file)
xray_fuzzers(xray_dicom dicom_geometry)
target_link_libraries(fuzz_dicom_file PRIVATE fuzz_part_xray_dicom)
xray_fuzzers(ros image_message bag_session)

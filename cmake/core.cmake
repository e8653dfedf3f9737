find_package(Eigen3 REQUIRED NO_MODULE)
find_package(Threads REQUIRED)
find_package(OpenCL REQUIRED)
if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  # Named components: the bare package drags in MPI, FFTW and VTK.
  find_package(ITK REQUIRED COMPONENTS
    ITKCommon ITKIOImageBase ITKIONIFTI ITKNrrdIO ITKIONRRD ITKIOMeta ITKIOGDCM ITKMesh)
  find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs calib3d)
endif()

# A new .cpp in a room's folder is picked up at the next build; the paper's method has a folder of its own in a room.
macro(xray_glob variable room)
  file(GLOB ${variable} CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/${room}/*.cpp
       ${CMAKE_CURRENT_SOURCE_DIR}/src/${room}/paper/*.cpp)
endmacro()

# itk_*.cpp include ITK's headers and no Eigen: ITK carries an Eigen of its own. Each room's are a library beside it.
macro(xray_take_itk variable sources)
  set(${variable} ${${sources}})
  list(FILTER ${variable} INCLUDE REGEX "/itk_[a-z_]*\\.cpp$")
  list(FILTER ${sources} EXCLUDE REGEX "/itk_[a-z_]*\\.cpp$")
endmacro()

xray_glob(common_sources common)
xray_take_itk(common_itk_sources common_sources)
# YAML is read where there is yaml-cpp, which the compute-only build does without.
list(FILTER common_sources EXCLUDE REGEX "/yaml_file\\.cpp$")
xray_room(common SOURCES ${common_sources})

xray_glob(geometry_sources geometry)
xray_room(geometry SOURCES ${geometry_sources} ROOMS common LIBRARIES Eigen3::Eigen)

xray_glob(volume_sources volume)
xray_take_itk(volume_itk_sources volume_sources)
# These stand on them.
set(reading_sources ${CMAKE_CURRENT_SOURCE_DIR}/src/volume/byte_stream.cpp
                    ${CMAKE_CURRENT_SOURCE_DIR}/src/volume/meta_image.cpp
                    ${CMAKE_CURRENT_SOURCE_DIR}/src/volume/nifti_header.cpp
                    ${CMAKE_CURRENT_SOURCE_DIR}/src/volume/nifti_file.cpp
                    ${CMAKE_CURRENT_SOURCE_DIR}/src/volume/dicom_series.cpp
                    ${CMAKE_CURRENT_SOURCE_DIR}/src/volume/volume_io.cpp
                    ${CMAKE_CURRENT_SOURCE_DIR}/src/volume/bone_surface.cpp)
list(REMOVE_ITEM volume_sources ${reading_sources})
xray_room(volume SOURCES ${volume_sources} ROOMS geometry LIBRARIES Eigen3::Eigen Threads::Threads)

xray_glob(image_sources image)
xray_take_itk(image_itk_sources image_sources)
file(GLOB opencv_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/image/xray_frame.cpp
     ${CMAKE_CURRENT_SOURCE_DIR}/src/image/linearisation.cpp
     ${CMAKE_CURRENT_SOURCE_DIR}/src/image/*mask*.cpp ${CMAKE_CURRENT_SOURCE_DIR}/src/image/*undistortion*.cpp
     ${CMAKE_CURRENT_SOURCE_DIR}/src/image/*grid*.cpp ${CMAKE_CURRENT_SOURCE_DIR}/src/image/xray_image_file.cpp
     ${CMAKE_CURRENT_SOURCE_DIR}/src/image/landmarks/*.cpp)
list(REMOVE_ITEM image_sources ${opencv_sources})
xray_room(image SOURCES ${image_sources} ROOMS geometry LIBRARIES Eigen3::Eigen Threads::Threads)

# The device's side and the paper's method have folders of their own, with their kernels.
file(GLOB drr_sources CONFIGURE_DEPENDS
     ${CMAKE_CURRENT_SOURCE_DIR}/src/drr/*.cpp ${CMAKE_CURRENT_SOURCE_DIR}/src/drr/*/*.cpp)
file(GLOB kernels CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/drr/*/kernels/*.cl)
xray_room(drr SOURCES ${drr_sources} ROOMS volume image LIBRARIES Eigen3::Eigen OpenCL::OpenCL Threads::Threads)
xray_embed_kernels(xray_registration_drr ${kernels})

xray_glob(registration_sources registration)
xray_room(registration SOURCES ${registration_sources} ROOMS drr LIBRARIES Eigen3::Eigen)

xray_glob(evaluation_sources evaluation)
# Trials go through the pipeline, which the compute-only build has not; nor can it read another patient's CT.
set(trials_sources ${CMAKE_CURRENT_SOURCE_DIR}/src/evaluation/trials.cpp
                   ${CMAKE_CURRENT_SOURCE_DIR}/src/evaluation/lost_trial.cpp
                   ${CMAKE_CURRENT_SOURCE_DIR}/src/evaluation/wrong_input.cpp
                   ${CMAKE_CURRENT_SOURCE_DIR}/src/evaluation/wrong_views.cpp)
list(REMOVE_ITEM evaluation_sources ${trials_sources})
xray_room(evaluation SOURCES ${evaluation_sources} ROOMS registration
          LIBRARIES Eigen3::Eigen Threads::Threads)

set(core_rooms common geometry volume image drr registration evaluation)
# The way of a frame from pixels to a verdict reads parameters (yaml-cpp) and masks (OpenCV).
if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  find_package(yaml-cpp REQUIRED)
  xray_room(common_yaml SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/common/yaml_file.cpp ROOMS common
            LIBRARIES ${YAML_CPP_LIBRARIES})
  xray_glob(pipeline_sources pipeline)
  xray_room(pipeline SOURCES ${pipeline_sources} ROOMS registration common_yaml
            LIBRARIES Eigen3::Eigen ${YAML_CPP_LIBRARIES})
  target_include_directories(xray_registration_pipeline SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
  xray_room(evaluation_trials SOURCES ${trials_sources} ROOMS evaluation pipeline
            LIBRARIES Eigen3::Eigen)
  list(APPEND core_rooms common_yaml pipeline evaluation_trials)
endif()
if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  # GDCM, which ITK reads DICOM with, prints what it finds in files; its switch for that is in a header of its own.
  find_path(GDCM_INCLUDE_DIR gdcmTrace.h HINTS ${ITK_INCLUDE_DIRS} PATH_SUFFIXES gdcm-3.0 gdcm-2.8 REQUIRED)
  set(gdcm_libraries gdcmMSFF gdcmDSED gdcmDICT gdcmIOD gdcmCommon)
  xray_room(common_itk SOURCES ${common_itk_sources} ROOMS common LIBRARIES ${ITK_LIBRARIES} ${gdcm_libraries})
  xray_room(volume_itk SOURCES ${volume_itk_sources} ${reading_sources} ROOMS volume common_itk
            LIBRARIES Eigen3::Eigen ${ITK_LIBRARIES} ${gdcm_libraries})
  xray_room(image_itk SOURCES ${image_itk_sources} ROOMS image common_itk LIBRARIES ${ITK_LIBRARIES})
  foreach(room common_itk volume_itk image_itk)
    target_include_directories(xray_registration_${room} SYSTEM PRIVATE ${ITK_INCLUDE_DIRS} ${GDCM_INCLUDE_DIR})
  endforeach()
  xray_room(image_opencv SOURCES ${opencv_sources} ROOMS image image_itk common_yaml
            LIBRARIES Eigen3::Eigen ${OpenCV_LIBS} ${YAML_CPP_LIBRARIES})
  target_include_directories(xray_registration_image_opencv SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
  # X-rays in DICOM: the geometry, and GDCM in gdcm_*.cpp.
  file(GLOB dicom_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/image/dicom/*.cpp)
  xray_room(image_dicom SOURCES ${dicom_sources} ROOMS image common_itk
            LIBRARIES Eigen3::Eigen ${gdcm_libraries})
  target_include_directories(xray_registration_image_dicom SYSTEM PRIVATE ${GDCM_INCLUDE_DIR})
  list(APPEND core_rooms common_itk volume_itk image_itk image_opencv image_dicom)
endif()

# The core library: no ROS.
set(core_objects "")
set(core_link "")
foreach(room IN LISTS core_rooms)
  list(APPEND core_objects $<TARGET_OBJECTS:xray_registration_${room}>)
endforeach()
add_library(xray_registration_core SHARED ${core_objects})
target_include_directories(xray_registration_core PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
target_link_libraries(xray_registration_core PUBLIC Eigen3::Eigen OpenCL::OpenCL Threads::Threads)
if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  target_link_libraries(xray_registration_core PUBLIC ${YAML_CPP_LIBRARIES})
  target_link_libraries(xray_registration_core PRIVATE ${ITK_LIBRARIES} ${gdcm_libraries} ${OpenCV_LIBS})
endif()

# A room is a folder of src/ and include/ with one purpose. Each becomes an object library that sees only the rooms
# below it, so a wrong include of a .cpp fails to link in that room's tests; test/architecture checks the includes.

# xray_room(<name> SOURCES ... [ROOMS lower rooms ...] [LIBRARIES ...])
function(xray_room name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;ROOMS;LIBRARIES" ${ARGN})
  set(target xray_registration_${name})
  add_library(${target} OBJECT ${ROOM_SOURCES})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
  target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(${target} PRIVATE xray_registration_warnings)
  target_link_libraries(${target} PUBLIC ${ROOM_LIBRARIES})
  set_target_properties(${target} PROPERTIES XRAY_ROOMS "${ROOM_ROOMS}")
endfunction()

# All rooms that the named ones stand on, themselves included.
function(xray_rooms_below result)
  set(pending ${ARGN})
  set(seen "")
  while(pending)
    list(POP_FRONT pending room)
    if(NOT room IN_LIST seen)
      list(APPEND seen ${room})
      get_target_property(lower xray_registration_${room} XRAY_ROOMS)
      if(lower)
        list(APPEND pending ${lower})
      endif()
    endif()
  endwhile()
  set(${result} ${seen} PARENT_SCOPE)
endfunction()

# xray_link_rooms(<target> rooms...): the rooms and everything below them.
function(xray_link_rooms target)
  xray_rooms_below(rooms ${ARGN})
  foreach(room IN LISTS rooms)
    target_link_libraries(${target} PRIVATE xray_registration_${room})
  endforeach()
endfunction()

# xray_embed_kernels(<target> <room folder> files...): OpenCL C sources as string constants, named after the file.
function(xray_embed_kernels target)
  foreach(kernel IN LISTS ARGN)
    get_filename_component(stem ${kernel} NAME_WE)
    set(generated ${CMAKE_CURRENT_BINARY_DIR}/kernels/${stem}_kernel.cpp)
    add_custom_command(
      OUTPUT ${generated}
      COMMAND ${CMAKE_COMMAND} -DINPUT=${kernel} -DOUTPUT=${generated} -DSTEM=${stem}
              -P ${CMAKE_CURRENT_SOURCE_DIR}/cmake/embed_kernel.cmake
      DEPENDS ${kernel} ${CMAKE_CURRENT_SOURCE_DIR}/cmake/embed_kernel.cmake
      COMMENT "Embedding ${stem}.cl")
    target_sources(${target} PRIVATE ${generated})
  endforeach()
endfunction()

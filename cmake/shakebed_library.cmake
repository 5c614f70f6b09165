# The libraries that others build on: shakebed::statistics, shakebed::sim, shakebed::ingest, shakebed::fit.
#
# Users include <shakebed/sim/scene.hpp>. In the tree that header is sim/scene/scene.hpp; write_public_headers.cmake makes
# the public form, in <build>/include for programs of this build and in the prefix when it is installed. No compile flag
# of this project reaches its users: shakebed_options stays private.

option(SHAKEBED_SHARED "Build the libraries as shared ones" OFF)
option(SHAKEBED_INSTALL "Make the install rules" ${PROJECT_IS_TOP_LEVEL})
if(SHAKEBED_SHARED)
  set(SHAKEBED_LIBRARY_TYPE SHARED)
else()
  set(SHAKEBED_LIBRARY_TYPE STATIC)
endif()
set(shakebed_package_directory "${CMAKE_INSTALL_LIBDIR}/cmake/shakebed")
set(shakebed_install_headers "")

# Where TARGET, installed into DESTINATION below the prefix, finds shared libraries of ours: relative to itself, so that
# the prefix may be moved.
function(shakebed_finds_libraries target destination)
  if(SHAKEBED_SHARED)
    file(RELATIVE_PATH libraries "/${destination}" "/${CMAKE_INSTALL_LIBDIR}")
    set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/${libraries}" BUILD_RPATH "$ORIGIN/${libraries}")
  endif()
endfunction()

# shakebed_public_library(ROOM HEADERS headers... [REQUIRES rooms...] [PRIVATE_PACKAGES names...] [PRIVATE_LIBRARIES names...])
# Makes shakebed_<room> a library for others. HEADERS: as they stand in the tree. REQUIRES: rooms whose headers its
# headers include. PRIVATE_PACKAGES, PRIVATE_LIBRARIES: what pkg-config must add to link the static library, by its name
# for pkg-config or for the linker.
function(shakebed_public_library room)
  cmake_parse_arguments(ARG "" "" "HEADERS;REQUIRES;PRIVATE_PACKAGES;PRIVATE_LIBRARIES" ${ARGN})
  set(target shakebed_${room})
  add_library(shakebed::${room} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${room} VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} DEFINE_SYMBOL "")
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:shakebed_options>)
  target_include_directories(${target} INTERFACE $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  foreach(required IN LISTS ARG_REQUIRES)
    target_link_libraries(${target} PUBLIC shakebed_${required})
  endforeach()
  add_dependencies(${target} shakebed_public_headers)
  set_property(GLOBAL APPEND PROPERTY SHAKEBED_PUBLIC_HEADERS ${ARG_HEADERS})
  set_property(GLOBAL APPEND PROPERTY SHAKEBED_PUBLIC_ROOMS ${room})
  shakebed_finds_libraries(${target} "${CMAKE_INSTALL_LIBDIR}")
  if(NOT SHAKEBED_INSTALL)
    return()
  endif()
  install(TARGETS ${target} EXPORT shakebed_${room}
          LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT program NAMELINK_COMPONENT development
          ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
  install(EXPORT shakebed_${room} FILE shakebed-${room}-targets.cmake NAMESPACE shakebed::
          DESTINATION "${shakebed_package_directory}" COMPONENT development)

  set(pc_requires "")
  foreach(required IN LISTS ARG_REQUIRES)
    string(APPEND pc_requires "shakebed-${required} ")
  endforeach()
  string(REPLACE ";" " " pc_private "${ARG_PRIVATE_PACKAGES}")
  list(TRANSFORM ARG_PRIVATE_LIBRARIES PREPEND "-l")
  string(REPLACE ";" " " pc_libraries "${ARG_PRIVATE_LIBRARIES}")
  set(pc_room "${room}")
  file(RELATIVE_PATH pc_prefix "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  string(REGEX REPLACE "/$" "" pc_prefix "${pc_prefix}")
  configure_file("${PROJECT_SOURCE_DIR}/cmake/shakebed.pc.in" "${PROJECT_BINARY_DIR}/shakebed-${room}.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/shakebed-${room}.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig"
          COMPONENT development)
endfunction()

# After all rooms: the target that writes the public headers, and the package files.
function(shakebed_finish_libraries)
  get_property(headers GLOBAL PROPERTY SHAKEBED_PUBLIC_HEADERS)
  get_property(rooms GLOBAL PROPERTY SHAKEBED_PUBLIC_ROOMS)
  set(script "${PROJECT_SOURCE_DIR}/cmake/write_public_headers.cmake")
  set(inputs "${script}")
  foreach(room IN LISTS rooms)
    file(GLOB_RECURSE found CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${room}/*.hpp")
    list(APPEND inputs ${found})
  endforeach()
  set(stamp "${PROJECT_BINARY_DIR}/public_headers.stamp")
  string(REPLACE ";" "," commas "${headers}")
  set(write ${CMAKE_COMMAND} "-DSOURCE_DIR=${PROJECT_SOURCE_DIR}" "-DOUTPUT=${PROJECT_BINARY_DIR}/include"
            "-DHEADERS=${commas}" "-DSTAMP=${stamp}" -P "${script}")
  # Written now to know their names: an object that includes one waits for the command and is compiled again after it.
  execute_process(COMMAND ${write} COMMAND_ERROR_IS_FATAL ANY)
  file(GLOB_RECURSE written "${PROJECT_BINARY_DIR}/include/shakebed/*.hpp")
  add_custom_command(
    OUTPUT "${stamp}"
    BYPRODUCTS ${written}
    COMMAND ${write}
    DEPENDS ${inputs}
    COMMENT "Writing the public headers"
    VERBATIM)
  add_custom_target(shakebed_public_headers DEPENDS "${stamp}")
  if(NOT SHAKEBED_INSTALL)
    return()
  endif()
  include(CMakePackageConfigHelpers)
  set(shakebed_rooms "${rooms}")
  set(shakebed_is_shared "${SHAKEBED_SHARED}")
  configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/shakebedConfig.cmake.in"
                                "${PROJECT_BINARY_DIR}/shakebedConfig.cmake"
                                INSTALL_DESTINATION "${shakebed_package_directory}")
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/shakebedConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
  install(FILES "${PROJECT_BINARY_DIR}/shakebedConfig.cmake" "${PROJECT_BINARY_DIR}/shakebedConfigVersion.cmake"
                "${PROJECT_SOURCE_DIR}/cmake/FindOpenCV.cmake"
          DESTINATION "${shakebed_package_directory}" COMPONENT development)
  install(DIRECTORY "${PROJECT_BINARY_DIR}/include/shakebed" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
          COMPONENT development)
endfunction()

# Writes the headers that users of the libraries include.
#
#   cmake -DSOURCE_DIR=<tree> -DOUTPUT=<include folder> -DHEADERS=sim/scene/scene.hpp,... -P write_public_headers.cmake
#
# A header of the list, <room>/<folder>/<name>.hpp, becomes <OUTPUT>/shakebed/<room>/<name>.hpp. A header that it needs
# and that is not of the list becomes <OUTPUT>/shakebed/<room>/detail/<name>.hpp. The #include lines are rewritten. Files
# that did not change are not touched.
cmake_minimum_required(VERSION 3.25)
string(REPLACE "," ";" HEADERS "${HEADERS}")

# The place of a header below <OUTPUT>.
function(public_place header variable)
  string(REGEX REPLACE "/.*" "" room "${header}")
  get_filename_component(name "${header}" NAME)
  if(header IN_LIST HEADERS)
    set(${variable} "shakebed/${room}/${name}" PARENT_SCOPE)
  else()
    set(${variable} "shakebed/${room}/detail/${name}" PARENT_SCOPE)
  endif()
endfunction()

set(waiting ${HEADERS})
set(done "")
set(places "")
while(waiting)
  list(POP_FRONT waiting header)
  if(header IN_LIST done)
    continue()
  endif()
  list(APPEND done "${header}")
  public_place("${header}" place)
  if(place IN_LIST places)
    message(FATAL_ERROR "two public headers would become ${place}")
  endif()
  list(APPEND places "${place}")

  file(READ "${SOURCE_DIR}/${header}" text)
  string(REGEX MATCHALL "#include \"[^\"]+\"" includes "${text}")
  foreach(line IN LISTS includes)
    string(REGEX REPLACE "#include \"([^\"]+)\"" "\\1" included "${line}")
    public_place("${included}" included_place)
    string(REPLACE "${line}" "#include <${included_place}>" text "${text}")
    list(APPEND waiting "${included}")
  endforeach()

  set(file "${OUTPUT}/${place}")
  set(before "")
  if(EXISTS "${file}")
    file(READ "${file}" before)
  endif()
  if(NOT before STREQUAL text)
    file(WRITE "${file}" "${text}")
  endif()
endwhile()

# A header that is public no longer goes.
file(GLOB_RECURSE present RELATIVE "${OUTPUT}" "${OUTPUT}/shakebed/*.hpp")
foreach(place IN LISTS present)
  if(NOT place IN_LIST places)
    file(REMOVE "${OUTPUT}/${place}")
  endif()
endforeach()
if(STAMP)
  file(TOUCH "${STAMP}")
endif()

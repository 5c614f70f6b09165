# Writes version.hpp with the commit of the source, at every build, but only when it changed.
execute_process(COMMAND git describe --always --dirty --abbrev=12 WORKING_DIRECTORY "${SOURCE_DIR}"
                OUTPUT_VARIABLE revision ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
# The day of that commit, for metadata of results: the same for every run of this program. Without git the day of the
# build (CMake takes SOURCE_DATE_EPOCH where it is set), as long as the program is not built anew.
execute_process(COMMAND git log -1 --format=%cs WORKING_DIRECTORY "${SOURCE_DIR}"
                OUTPUT_VARIABLE source_date ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
if(NOT source_date)
  if(EXISTS "${OUTPUT}")
    file(STRINGS "${OUTPUT}" source_date REGEX "SHAKEBED_SOURCE_DATE")
    string(REGEX REPLACE "^.*\"(.*)\".*$" "\\1" source_date "${source_date}")
  endif()
  if(NOT source_date)
    string(TIMESTAMP source_date "%Y-%m-%d" UTC)
  endif()
endif()
set(text "#pragma once
#define SHAKEBED_VERSION \"${VERSION}\"
#define SHAKEBED_REVISION \"${revision}\"
#define SHAKEBED_SOURCE_DATE \"${source_date}\"
#define SHAKEBED_BUILD_TYPE \"${BUILD_TYPE}\"
")
set(old "")
if(EXISTS "${OUTPUT}")
  file(READ "${OUTPUT}" old)
endif()
if(NOT old STREQUAL text)
  file(WRITE "${OUTPUT}" "${text}")
endif()

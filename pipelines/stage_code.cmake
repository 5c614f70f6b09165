# Fingerprints of the code behind each stage, taken at every build; the file is written only when one has changed.
#
#   cmake -DSOURCE_DIR=<the project> -DOUTPUT=<file.cpp> [-DLIST=<file.txt>] -P stage_code.cmake
#
# A stage is a file pipelines/stages/<name>.cpp that defines `StageRow <name>_stage()`. Its code is that file and, over
# again for each of these files:
#   - every header of the project that it includes,
#   - for a header, the .cpp of the same name beside it,
#   - for a header, every .cpp of the same folder with the line "// implements: <path of the header>".
# What runs, shows or asks for stages (runner/, report/, cli/) changes no result, so a stage that reaches it is an error;
# neither does <name>_report.cpp, which the rules above do not reach.
#
# A file counts without its // comments and without white space outside of literals. LIST names the files of each stage,
# one "<stage> <file>" a line, for the tests.
cmake_minimum_required(VERSION 3.25)

set(folders statistics sim ingest fit pipelines)
set(above_stages "^pipelines/(runner|report|cli)/")

# A line of code up to its comment, literals passed over whole: what looks like a comment inside of one is none.
set(literal "\"(\\\\.|[^\"\\\\\n])*\"|'(\\\\.|[^'\\\\\n])'")
set(line "\n(([0-9a-fA-F]'[0-9a-fA-F]|${literal}|[^\"'/\n]|/[^/\"'\n])*)//[^\n]*")

# The text of a file without comments, and the project's headers it includes.
function(read_code file out_text out_headers)
  file(READ "${SOURCE_DIR}/${file}" text)
  string(REGEX REPLACE "${line}" "\n\\1" text "\n${text}")
  string(REGEX MATCHALL "#[ \t]*include[ \t]*\"[^\"\n]+\"" includes "${text}")
  set(headers "")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE ".*\"([^\"]+)\"" "\\1" header "${include}")
    if(EXISTS "${SOURCE_DIR}/${header}")
      list(APPEND headers "${header}")
    endif()
  endforeach()
  string(REGEX MATCHALL "${literal}" literals "${text}")  # white space means something in these
  string(REGEX REPLACE "[ \t\r\n]+" "" text "${text}")
  string(APPEND text "\n${literals}")
  set(${out_text} "${text}" PARENT_SCOPE)
  set(${out_headers} "${headers}" PARENT_SCOPE)
endfunction()

# What a file leads to, each file read once: edges_<file> and hash_<file>.
function(look_at file)
  read_code("${file}" text headers)
  string(SHA256 hash "${text}")
  set(edges "${headers}")
  if(file MATCHES "\\.hpp$")
    string(REGEX REPLACE "\\.hpp$" ".cpp" sibling "${file}")
    if(EXISTS "${SOURCE_DIR}/${sibling}")
      list(APPEND edges "${sibling}")
    endif()
    list(APPEND edges ${implementations_${file}})
  endif()
  set_property(GLOBAL PROPERTY "hash_${file}" "${hash}")
  set_property(GLOBAL PROPERTY "edges_${file}" "${edges}")
endfunction()

function(files_of_stage first out_files)
  set(waiting "${first}")
  set(found "${first}")
  while(waiting)
    list(POP_FRONT waiting file)
    get_property(known GLOBAL PROPERTY "hash_${file}" SET)
    if(NOT known)
      look_at("${file}")
    endif()
    get_property(edges GLOBAL PROPERTY "edges_${file}")
    foreach(next IN LISTS edges)
      if(next MATCHES "${above_stages}")
        message(FATAL_ERROR "${file} includes ${next}: the code of a stage must not depend on what runs or shows it")
      endif()
      if(NOT next IN_LIST found)
        list(APPEND found "${next}")
        list(APPEND waiting "${next}")
      endif()
    endforeach()
  endwhile()
  list(SORT found)
  set(${out_files} "${found}" PARENT_SCOPE)
endfunction()

# "// implements:" lines: header → files.
foreach(folder IN LISTS folders)
  file(GLOB_RECURSE sources RELATIVE "${SOURCE_DIR}" "${SOURCE_DIR}/${folder}/*.cpp")
  foreach(source IN LISTS sources)
    file(STRINGS "${SOURCE_DIR}/${source}" lines REGEX "^// implements: ")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^// implements: +([^ ]+) *$" "\\1" header "${line}")
      get_filename_component(of_header "${header}" DIRECTORY)
      get_filename_component(of_source "${source}" DIRECTORY)
      if(NOT EXISTS "${SOURCE_DIR}/${header}" OR NOT of_header STREQUAL of_source)
        message(FATAL_ERROR "${source}: \"${line}\": there is no such header beside it")
      endif()
      list(APPEND "implementations_${header}" "${source}")
    endforeach()
  endforeach()
endforeach()

set(rows "")
set(listing "")
file(GLOB stage_files RELATIVE "${SOURCE_DIR}" "${SOURCE_DIR}/pipelines/stages/*.cpp")
list(SORT stage_files)
foreach(stage_file IN LISTS stage_files)
  get_filename_component(name "${stage_file}" NAME_WE)
  file(STRINGS "${SOURCE_DIR}/${stage_file}" definition REGEX "^StageRow ${name}_stage\\(")
  if(NOT definition)
    continue()
  endif()
  files_of_stage("${stage_file}" files)
  set(all "")
  foreach(file IN LISTS files)
    get_property(hash GLOBAL PROPERTY "hash_${file}")
    string(APPEND all "${file} ${hash}\n")
    string(APPEND listing "${name} ${file}\n")
  endforeach()
  string(SHA256 fingerprint "${all}")
  string(SUBSTRING "${fingerprint}" 0 32 fingerprint)
  string(APPEND rows "  if (stage == \"${name}\") return \"${fingerprint}\";\n")
endforeach()

set(text "// Written by pipelines/stage_code.cmake.
#include \"pipelines/runner/stage_code.hpp\"

namespace shakebed::pipelines {

std::string_view stage_code(std::string_view stage) {
${rows}  return {};
}

}  // namespace shakebed::pipelines
")
set(old "")
if(EXISTS "${OUTPUT}")
  file(READ "${OUTPUT}" old)
endif()
if(NOT old STREQUAL text)
  file(WRITE "${OUTPUT}" "${text}")
endif()
if(LIST)
  file(WRITE "${LIST}" "${listing}")
endif()

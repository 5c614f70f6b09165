# What every target of the project shares: the language, the warnings, the instruction set and the arithmetic.
#
# The same seed must give the same bytes on every machine, so floating-point contraction is off everywhere (a fused
# multiply-add rounds once where two instructions round twice) and -ffast-math is used nowhere. g++ 12 fuses a b + c d and
# a d - c b all the same when it vectorises straight code (vfmaddsub), so that is off too: no scene takes more
# instructions for it (tests/bench/instructions.sh), and tests/house/contraction.sh looks at the program.

include(CheckCXXCompilerFlag)
include(CheckCXXSourceRuns)

set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Debug, Release or RelWithDebInfo" FORCE)
endif()

# x86-64-v3 (AVX2) where this machine has it. The results do not depend on it, only the speed.
if(NOT DEFINED SHAKEBED_ARCH)
  set(CMAKE_REQUIRED_FLAGS "-march=x86-64-v3")
  check_cxx_source_runs("
    int main() { return __builtin_cpu_supports(\"avx2\") && __builtin_cpu_supports(\"bmi2\") ? 0 : 1; }"
    SHAKEBED_HAVE_X86_64_V3)
  unset(CMAKE_REQUIRED_FLAGS)
  if(SHAKEBED_HAVE_X86_64_V3)
    set(default_arch x86-64-v3)
  else()
    set(default_arch "")
  endif()
  set(SHAKEBED_ARCH "${default_arch}" CACHE STRING "Value of -march, empty for the compiler's default")
endif()

# -Wno-psabi: without AVX, g++ warns of every vector of four that is passed between functions. Here they are inline.
add_library(shakebed_options INTERFACE)
target_compile_features(shakebed_options INTERFACE cxx_std_20)
target_include_directories(shakebed_options INTERFACE "${PROJECT_SOURCE_DIR}")
target_compile_options(shakebed_options INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -ffp-contract=off -fno-tree-slp-vectorize -fno-math-errno -Wno-psabi $<$<BOOL:${SHAKEBED_WERROR}>:-Werror>)
# Programs name the libraries they call alone: OpenCV's modules would cost a quarter of a second at each start.
target_link_options(shakebed_options INTERFACE $<$<PLATFORM_ID:Linux>:-Wl,--as-needed>)
if(SHAKEBED_ARCH)
  target_compile_options(shakebed_options INTERFACE "-march=${SHAKEBED_ARCH}")
endif()
# g++ sweeps up its own memory again and again while it compiles. It is let have a gigabyte first.
target_compile_options(shakebed_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1048576>)
if(SHAKEBED_SANITIZE)
  target_compile_options(shakebed_options INTERFACE "-fsanitize=${SHAKEBED_SANITIZE}" -fno-omit-frame-pointer
                         -fno-sanitize-recover=all)
  target_link_options(shakebed_options INTERFACE "-fsanitize=${SHAKEBED_SANITIZE}")
endif()

if(SHAKEBED_COVERAGE)  # counts of executed lines, g++ alone: tests/robustness/coverage reads them
  target_compile_options(shakebed_options INTERFACE --coverage -fprofile-abs-path)
  target_link_options(shakebed_options INTERFACE --coverage)
endif()

# How g++ compiles fit/ and ingest/: with loops in lanes, without which a fit takes twice as long and disks take 50 to
# 150 % longer to be found. Left out are passes that take a tenth of the time to compile and gain nothing.
set(SHAKEBED_LEAN_COMPILE "")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  list(APPEND SHAKEBED_LEAN_COMPILE $<$<CONFIG:Release>:-ftree-vectorize> $<$<CONFIG:Release>:-fvect-cost-model=dynamic>)
  foreach(pass tree-pre gcse schedule-insns2 ipa-icf ipa-ra crossjumping)
    list(APPEND SHAKEBED_LEAN_COMPILE $<$<CONFIG:Release>:-fno-${pass}>)
  endforeach()
endif()
# What hardly computes (stages, reports, command line) and what is compiled often and run briefly (tests): half the time to
# compile of -O3, and a quarter less than -O1. No result depends on it.
set(SHAKEBED_QUICK_COMPILE $<$<CONFIG:Release>:-Og>)
# Tests that start the program wait for it, hardly ever for themselves.
set(SHAKEBED_QUICKEST_COMPILE $<$<CONFIG:Release>:-O0>)

# Headers that many files read, read once.
option(SHAKEBED_PRECOMPILE "Precompiled headers" ON)
function(shakebed_test_headers name)
  file(CONFIGURE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp" CONTENT "int main() {}\n")
  add_executable(${name} EXCLUDE_FROM_ALL "${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp")
  target_link_libraries(${name} PRIVATE shakebed_options nlohmann_json::nlohmann_json GTest::gtest GTest::gmock)
  target_compile_options(${name} PRIVATE ${ARGN})
  target_precompile_headers(${name} PRIVATE <gtest/gtest.h> <gmock/gmock.h> <nlohmann/json.hpp>
                            <algorithm> <cmath> <filesystem> <fstream> <functional> <map> <optional>
                            <sstream> <string> <vector>)
endfunction()

# shakebed_test(NAME SOURCES sources... LABELS labels... LIBRARIES libraries... [TIMEOUT seconds] [UNITY files]
#               [OPTIMIZED] [BY_SUITE] [BY_HAND] [LONG patterns...] [LONG_COST seconds] [STUDY patterns...])
# One GoogleTest program; each of its tests becomes a ctest case with the labels given. OPTIMIZED: the tests themselves
# compute long. BY_SUITE: the tests of a suite are one ctest case, for programs of many brief tests or that take long to start
# (OpenCV's libraries take a quarter of a second); the suites in SMALL together are one more. LONG, STUDY: names of tests (* and ?
# as in --gtest_filter) that also get the label long or study. UNITY: how many files are compiled at once, if not as many as elsewhere.
# LONG_COST: what a long one takes; ctest starts the dearest first. BY_HAND: the program has no quick tests, and is built
# with the target by_hand, not with all.
function(shakebed_test name)
  cmake_parse_arguments(ARG "OPTIMIZED;BY_SUITE;BY_HAND" "TIMEOUT;UNITY;LONG_COST" "SOURCES;LABELS;LIBRARIES;LONG;STUDY;SMALL" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  if(NOT DEFINED ARG_UNITY)
    set(ARG_UNITY 8)
  endif()
  set_target_properties(${name} PROPERTIES UNITY_BUILD_BATCH_SIZE ${ARG_UNITY})
  target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} shakebed_options GTest::gtest GTest::gmock GTest::gtest_main)
  if("shakebed_test_program" IN_LIST ARG_LIBRARIES)
    set(compile ${SHAKEBED_QUICKEST_COMPILE})
    set(headers shakebed_program_test_headers)
  else()
    set(compile ${SHAKEBED_QUICK_COMPILE})
    set(headers shakebed_test_headers)
  endif()
  if(NOT ARG_OPTIMIZED)
    target_compile_options(${name} PRIVATE ${compile})
    if(SHAKEBED_PRECOMPILE)
      target_precompile_headers(${name} REUSE_FROM ${headers})
    endif()
  endif()
  target_compile_definitions(${name} PRIVATE "SHAKEBED_SOURCE_DIR=\"${PROJECT_SOURCE_DIR}\"")
  list(JOIN ARG_LONG ":" long)
  list(JOIN ARG_STUDY ":" study)
  set(slow ${ARG_LONG} ${ARG_STUDY})
  list(JOIN slow ":" slow)
  set(SMALL_SUITES ${ARG_SMALL})
  set(discover shakebed_discover_tests)
  if(ARG_BY_SUITE)
    set(discover shakebed_discover_suites)
  endif()
  if(ARG_BY_HAND)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
    add_dependencies(by_hand ${name})
  else()
    cmake_language(CALL ${discover} ${name} quick "-${slow}" ${ARG_TIMEOUT} ${ARG_LABELS})
  endif()
  if(ARG_LONG)
    cmake_language(CALL ${discover} ${name} long "${long}" ${ARG_TIMEOUT} ${ARG_LABELS} long)
  endif()
  if(ARG_STUDY)
    cmake_language(CALL ${discover} ${name} study "${study}" ${ARG_TIMEOUT} ${ARG_LABELS} study)
  endif()
endfunction()

# The tests of the program `name` that pass `filter`, with the labels that follow. With PRE_TEST discovery a list of labels
# loses all but its first on the way to ctest: the labels are set by a script that ctest reads after it has discovered
# the tests.
function(shakebed_discover_tests name part filter timeout)
  set(cost 0)
  if(part STREQUAL "long" AND ARG_LONG_COST)
    set(cost ${ARG_LONG_COST})
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60 TEST_FILTER "${filter}"
                       TEST_LIST ${name}_${part}_tests PROPERTIES TIMEOUT ${timeout} COST ${cost})
  set(labels_file "${CMAKE_CURRENT_BINARY_DIR}/${name}_${part}_labels.cmake")
  file(WRITE "${labels_file}" "foreach(test IN LISTS ${name}_${part}_tests)\n"
       "  set_tests_properties(\"\${test}\" PROPERTIES LABELS \"${ARGN}\")\nendforeach()\n"
       "set_tests_properties(${name}_NOT_BUILT PROPERTIES LABELS \"${ARGN}\")\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${labels_file}")
endfunction()

# The same with one ctest case a suite: suites.cmake finds them when ctest starts.
function(shakebed_discover_suites name part filter timeout)
  set(file "${CMAKE_CURRENT_BINARY_DIR}/${name}_${part}_suites.cmake")
  set(suffix "")
  if(NOT part STREQUAL "quick")
    set(suffix ".${part}")
  endif()
  file(GENERATE OUTPUT "${file}" CONTENT
       "set(program \"$<TARGET_FILE:${name}>\")\nset(filter \"${filter}\")\nset(timeout ${timeout})\nset(labels \"${ARGN}\")
set(suffix \"${suffix}\")\nset(small \"${SMALL_SUITES}\")
include(\"${PROJECT_SOURCE_DIR}/cmake/suites.cmake\")\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${file}")
endfunction()

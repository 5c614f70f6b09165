# cmake -DPROGRAM=... "-DARGUMENTS=a|b" -DEXPECTED=<file> -P compare_output.cmake
# Fails unless the program ends with 0 and prints exactly the file.
string(REPLACE "|" ";" arguments "${ARGUMENTS}")
execute_process(COMMAND "${PROGRAM}" ${arguments} OUTPUT_VARIABLE printed ERROR_VARIABLE errors RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} ended with ${code}:\n${printed}${errors}")
endif()
file(READ "${EXPECTED}" expected)
if(NOT printed STREQUAL expected)
  message(FATAL_ERROR "the output differs from ${EXPECTED}. Printed:\n${printed}\nExpected:\n${expected}")
endif()

# camvox_test(<file>_test.cpp LIBRARIES <targets> [TIMEOUT <s>])
# Builds one GoogleTest program from the file and registers it; its cases are counted from the
# XML that it leaves in test_results.
function(camvox_test source)
  cmake_parse_arguments(ARG "" "TIMEOUT" "LIBRARIES;SOURCES" ${ARGN})
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  get_filename_component(stem ${source} NAME_WE)
  string(REPLACE "/" "_" name "${folder}_${stem}")
  add_executable(${name} ${source} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/support)
  target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} GTest::gmock GTest::gtest_main)
  add_test(NAME ${name}
           COMMAND ${name} --gtest_output=xml:${PROJECT_BINARY_DIR}/test_results/${name}.gtest.xml)
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)  # catches what hangs, also on a busy machine
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
endfunction()

# The start script, on a stand-in project. Nothing in it depends on how the C++ is compiled.
if(NOT CMAKE_CXX_FLAGS MATCHES "sanitize")
  add_test(NAME "script: ./wheelhop keeps its promises"
           COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/conformance/script.sh ${CMAKE_SOURCE_DIR}/wheelhop)
endif()

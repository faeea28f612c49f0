# Every command that writes, killed at each of its calls that change files. The library that kills is preloaded, which
# sanitizers do not allow.
if(NOT CMAKE_CXX_FLAGS MATCHES "sanitize")
  add_library(wheelhop_kill_at SHARED kill/kill_at.cpp)
  target_link_libraries(wheelhop_kill_at PRIVATE wheelhop_flags ${CMAKE_DL_LIBS})
  wheelhop_tests(kill wheelhop_plant LABEL kill
    FILES
    kill/commands.cpp)
  target_compile_definitions(test_kill PRIVATE WHEELHOP_PROGRAM="$<TARGET_FILE:wheelhop>"
                             WHEELHOP_KILL_AT="$<TARGET_FILE:wheelhop_kill_at>")
  add_dependencies(test_kill wheelhop wheelhop_kill_at)
endif()

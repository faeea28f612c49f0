# Tests of the base layer.
wheelhop_tests(base wheelhop_base ${CMAKE_DL_LIBS}
  FILES
  conformance/base.cpp
  lemma/linalg.cpp
  lemma/random.cpp
  conformance/layers.cpp
  kill/kill_at.cpp)
set_source_files_properties(kill/kill_at.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON SKIP_PRECOMPILE_HEADERS ON)

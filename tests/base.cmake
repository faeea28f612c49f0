# Tests of the base layer.
wheelhop_tests(base wheelhop_base
  FILES
  conformance/base.cpp
  lemma/linalg.cpp
  lemma/random.cpp
  conformance/layers.cpp)

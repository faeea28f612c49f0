# Tests of the identify layer.
wheelhop_tests(identify wheelhop_variants
  FILES
  lemma/trackability.cpp
  lemma/riccati.cpp
  lemma/inversion.cpp
  lemma/subspace.cpp
  lemma/direction.cpp
  lemma/sensitivities.cpp
  lemma/prior.cpp
  lemma/ridge.cpp
  conformance/pieces.cpp)

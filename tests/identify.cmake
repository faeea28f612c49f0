# Tests of the identify layer.
wheelhop_tests(identify wheelhop_variants
  FILES
  lemma/trackability.cpp
  lemma/riccati.cpp
  lemma/inversion.cpp
  lemma/hankel.cpp
  lemma/subspace.cpp
  lemma/direction.cpp
  lemma/sensitivities.cpp
  lemma/prior.cpp
  lemma/block_angular.cpp
  lemma/ridge.cpp
  lemma/subspace_methods.cpp
  lemma/inversion_methods.cpp
  lemma/map_families.cpp
  lemma/solver_budget.cpp
  lemma/pipeline.cpp
  lemma/linear_search.cpp
  lemma/initial_state.cpp
  lemma/surrogate_drives.cpp
  lemma/uncertainty.cpp
  lemma/delivery.cpp
  lemma/excitation.cpp
  conformance/pieces.cpp)

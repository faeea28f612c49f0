# Tests of the identify layer, one line a file.
wheelhop_test(lemma/trackability.cpp wheelhop_variants)
wheelhop_test(lemma/riccati.cpp wheelhop_variants)
wheelhop_test(lemma/inversion.cpp wheelhop_variants)
wheelhop_test(lemma/subspace.cpp wheelhop_variants)
wheelhop_test(lemma/direction.cpp wheelhop_variants)
wheelhop_test(lemma/sensitivities.cpp wheelhop_variants)
wheelhop_test(lemma/prior.cpp wheelhop_variants)
wheelhop_test(conformance/pieces.cpp wheelhop_variants)

# Tests of the gap layer, one line a file.
wheelhop_test(lemma/noise_floor.cpp wheelhop_gap wheelhop_variants)
wheelhop_test(lemma/plant_fit.cpp wheelhop_gap wheelhop_variants)
wheelhop_test(lemma/closure.cpp wheelhop_gap wheelhop_variants)
wheelhop_test(conformance/effects.cpp wheelhop_gap wheelhop_variants)
wheelhop_test(lemma/locate.cpp wheelhop_gap wheelhop_variants)
wheelhop_test(lemma/plan.cpp wheelhop_gap wheelhop_variants)

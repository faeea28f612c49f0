# Tests of the base layer, one line a file.
wheelhop_test(conformance/base.cpp wheelhop_base)
wheelhop_test(lemma/random.cpp wheelhop_base)
wheelhop_test(conformance/layers.cpp)

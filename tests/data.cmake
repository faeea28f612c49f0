# Tests of the data layer, one line a file.
wheelhop_test(lemma/metrics.cpp wheelhop_data)

# Tests of the data layer, one line a file.
wheelhop_test(lemma/metrics.cpp wheelhop_data)
wheelhop_test(conformance/records.cpp wheelhop_data)
wheelhop_test(conformance/tables.cpp wheelhop_data PkgConfig::matio)
wheelhop_test(lemma/resample.cpp wheelhop_data)
wheelhop_test(lemma/spectra.cpp wheelhop_data)

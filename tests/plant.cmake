# Tests of the plant layer, one line a file.
wheelhop_test(conformance/plant.cpp wheelhop_plant)
wheelhop_test(lemma/plant.cpp wheelhop_plant)
wheelhop_test(lemma/road.cpp wheelhop_plant)

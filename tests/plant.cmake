# Tests of the plant layer, one line a file.
wheelhop_test(conformance/plant.cpp wheelhop_plant)
wheelhop_test(lemma/plant.cpp wheelhop_plant)
wheelhop_test(lemma/plant_laws.cpp wheelhop_plant)
wheelhop_test(lemma/plant_memory.cpp wheelhop_plant)
wheelhop_test(lemma/plant_paths.cpp wheelhop_plant)
wheelhop_test(lemma/road.cpp wheelhop_plant)
wheelhop_test(end_to_end/generate.cpp wheelhop_plant)
target_sources(test_end_to_end_generate PRIVATE ${CMAKE_CURRENT_LIST_DIR}/../experiments/generate.cpp)

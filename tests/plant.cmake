# Tests of the plant layer.
wheelhop_tests(plant wheelhop_plant
  FILES
  conformance/plant.cpp
  lemma/plant.cpp
  lemma/plant_laws.cpp
  lemma/plant_memory.cpp
  lemma/plant_paths.cpp
  lemma/road.cpp
  lemma/stepping.cpp
  lemma/plant_inerter.cpp
  lemma/plant_force.cpp
  lemma/plant_ground.cpp
  lemma/schedule.cpp)

# Tests of the tables, the model file and what the commands are made of.
wheelhop_tests(experiments wheelhop_experiments
  FILES
  conformance/piece_tables.cpp
  conformance/diagnosis_file.cpp
  conformance/model_file.cpp
  lemma/blind_score.cpp
  end_to_end/generate.cpp
  end_to_end/blind.cpp
  lemma/blind_truth.cpp
  lemma/blind_effects.cpp
  end_to_end/blind_make.cpp)

# Runs of the whole program.
wheelhop_tests(program wheelhop_plant
  FILES
  end_to_end/command.cpp
  end_to_end/diagnose.cpp
  end_to_end/identify.cpp
  end_to_end/plan.cpp
  end_to_end/reproduce.cpp
  end_to_end/silverbox.cpp)
target_compile_definitions(test_program PRIVATE WHEELHOP_PROGRAM="$<TARGET_FILE:wheelhop>")
add_dependencies(test_program wheelhop)

# Tests of the tables, the model file and what the commands are made of.
wheelhop_tests(experiments wheelhop_experiments
  FILES
  conformance/piece_tables.cpp
  conformance/diagnosis_file.cpp
  conformance/file_uses.cpp
  conformance/input_checks.cpp
  conformance/model_file.cpp
  lemma/blind_score.cpp
  end_to_end/generate.cpp
  end_to_end/blind.cpp
  lemma/blind_truth.cpp
  lemma/blind_effects.cpp
  lemma/blind_added.cpp
  lemma/blind_mixed.cpp
  end_to_end/blind_make.cpp
  lemma/comparison.cpp
  lemma/experiment.cpp
  lemma/run.cpp)

# A piece from a folder of its own, put in as a user's is, and the conformance tests with it.
wheelhop_tests(consumer wheelhop_experiments
  FILES
  consumer/extra_pieces.cpp
  conformance/pieces.cpp)
wheelhop_extra_pieces(test_consumer ${CMAKE_CURRENT_SOURCE_DIR}/consumer/static_gain.cpp)

# Runs of the whole program.
wheelhop_tests(program wheelhop_variants
  FILES
  end_to_end/adjustable_damper.cpp
  end_to_end/command.cpp
  end_to_end/diagnose.cpp
  end_to_end/identify.cpp
  end_to_end/look.cpp
  end_to_end/plan.cpp
  end_to_end/reproduce.cpp
  end_to_end/rigs.cpp
  end_to_end/silverbox.cpp
  end_to_end/sweep.cpp
  study/identify_drawn.cpp)
target_compile_definitions(test_program PRIVATE WHEELHOP_PROGRAM="$<TARGET_FILE:wheelhop>")
if(WHEELHOP_MPI AND mpi_FOUND)
  target_compile_definitions(test_program PRIVATE WHEELHOP_HAS_MPI)
endif()
add_dependencies(test_program wheelhop)

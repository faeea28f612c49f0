# Tests of the tables, the model file and the program.
wheelhop_test(conformance/piece_tables.cpp wheelhop_experiments)
wheelhop_test(conformance/model_file.cpp wheelhop_variants)

# Runs of the whole program.
function(wheelhop_program_test file)
  get_filename_component(name ${file} NAME_WE)
  add_executable(test_program_${name} ${file})
  target_link_libraries(test_program_${name} PRIVATE wheelhop_test_main wheelhop_plant)
  target_compile_definitions(test_program_${name} PRIVATE WHEELHOP_PROGRAM="$<TARGET_FILE:wheelhop>")
  add_dependencies(test_program_${name} wheelhop)
  catch_discover_tests(test_program_${name} TEST_PREFIX "program_${name}: " PROPERTIES LABELS slow TIMEOUT 600)
endfunction()
wheelhop_program_test(end_to_end/diagnose.cpp)
wheelhop_program_test(end_to_end/identify.cpp)
wheelhop_program_test(end_to_end/plan.cpp)
wheelhop_program_test(end_to_end/reproduce.cpp)
wheelhop_program_test(end_to_end/silverbox.cpp)

# Figures and report page; skipped where Node.js or its packages are absent.
if(NOT CMAKE_CXX_FLAGS MATCHES "sanitize")
  add_test(NAME "plots: figures and report page"
           COMMAND bash -c "if ! type -P node >/dev/null || [[ ! -d '${CMAKE_SOURCE_DIR}/plots/node_modules/vega' ]]; then
                              echo 'skipped: Node.js or the packages of plots/ are not installed'; exit 77; fi
                            exec node --test '${CMAKE_SOURCE_DIR}/plots/test/render.test.mjs' '${CMAKE_SOURCE_DIR}/plots/test/diagnosis.test.mjs' '${CMAKE_SOURCE_DIR}/plots/test/sweep.test.mjs'")
  set_tests_properties("plots: figures and report page" PROPERTIES SKIP_RETURN_CODE 77)
endif()

# Tests of the verdict, linked with nothing that could simulate, and of the rest of the diagnosis.
wheelhop_tests(verdict wheelhop_verdict
  FILES
  lemma/decide.cpp
  lemma/decide_sets.cpp
  lemma/posterior.cpp)
wheelhop_tests(gap wheelhop_gap wheelhop_variants
  FILES
  lemma/noise_floor.cpp
  lemma/slow_channels.cpp
  lemma/continuous_drive.cpp
  lemma/coupling_start.cpp
  lemma/plant_fit.cpp
  lemma/force_scale.cpp
  lemma/hypothesis.cpp lemma/parameter_label.cpp
  lemma/closure.cpp
  lemma/pieces.cpp
  lemma/force_screen.cpp
  lemma/sharp_friction.cpp
  lemma/tone.cpp
  lemma/ceiling.cpp
  conformance/effect_forms.cpp
  conformance/effects.cpp
  lemma/locate.cpp
  lemma/operation.cpp
  lemma/instrument_faults.cpp
  lemma/shares.cpp
  lemma/profile.cpp
  lemma/split.cpp
  lemma/unknown_signal.cpp
  lemma/plan.cpp
  lemma/placebo.cpp)

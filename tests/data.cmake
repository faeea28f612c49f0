# Tests of the data layer.
wheelhop_tests(data wheelhop_data PkgConfig::matio ZLIB::ZLIB
  FILES
  lemma/metrics.cpp
  lemma/output_limits.cpp
  conformance/recordings.cpp
  conformance/records.cpp
  conformance/tables.cpp
  lemma/reading.cpp
  lemma/resample.cpp
  lemma/spectra.cpp
  lemma/spikes.cpp)

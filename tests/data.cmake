# Tests of the data layer, one line a file.

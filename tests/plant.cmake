# Tests of the plant layer, one line a file.

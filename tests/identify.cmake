# Tests of the identify layer, one line a file.

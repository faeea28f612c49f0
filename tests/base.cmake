# Tests of the base layer, one line a file.

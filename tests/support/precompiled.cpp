// A source of its own for the precompiled headers of the tests: main.cpp, which wants Catch2 whole, cannot use them.

// A source of its own for the precompiled headers: no layer waits for another one to get them.

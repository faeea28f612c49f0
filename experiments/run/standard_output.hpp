/// \file
/// Stdout as the place of a result.
#pragma once

namespace wheelhop {

/// At the start of the program: standard streams that are closed become streams to nowhere, so that no file that is
/// opened later takes their numbers and gets what is printed.
void keep_standard_streams();

/// UserError if stdout was closed: for a command whose result is what it prints.
void require_standard_output();

/// At the end of the program: MachineError if what was printed could not be written.
void finish_standard_output();

}  // namespace wheelhop

/// \file
/// What the program does with memory that it has freed.
#pragma once

namespace wheelhop {

/// From now on memory that is freed stays with the program up to 256 MB, and what is below 32 MB is taken from there.
/// A page that the system takes back and gives again costs a fault and a clearing, more than most of what is computed
/// in it; the most memory that is in use at one time stays the same. No effect where the C library is not glibc.
void keep_freed_memory();

}  // namespace wheelhop

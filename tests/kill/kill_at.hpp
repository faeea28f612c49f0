/// \file
/// Ends a process by SIGKILL at a chosen one of its calls that change files, so that a test meets every such moment
/// whatever the speed of the machine.
#pragma once

namespace wheelhop::test {

/// The n-th call from now of rename, renameat2, remove, unlink, unlinkat, rmdir, mkdir, or of write into a regular file
/// ends this process: before it has done anything, but a write after half of its bytes. 0: no call ends it.
/// A killed process loses nothing that it has written, so fsync is no moment of its own, and it is left out to save
/// time.
///
/// The calls are counted by functions of the same names, which stand before those of the C library: in a program that
/// is linked with kill_at.cpp, or in any program that preloads it as a library, where the environment variable
/// WHEELHOP_TEST_KILL_AT gives n from the start.
void kill_at_call(long n);

}  // namespace wheelhop::test

#!/usr/bin/env bash
# Fuzzes every reader of the project for so many seconds each: tests/fuzz/run.sh SECONDS.
# Builds the targets in build/fuzz, makes the inputs to begin with, and keeps new ones there for the next time. Ends with
# a status other than 0 at the first finding, whose input stands in build/fuzz/findings.
set -euo pipefail
seconds=${1:?the number of seconds for each target}
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd -P)
build=$root/build/fuzz
compiler=${CLANGXX:-clang++}

if ! type -P "$compiler" >/dev/null; then
  echo "skipped: fuzzing needs clang++ (Debian: clang), which is not here"
  exit 0
fi
if ! echo 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' |
  "$compiler" -fsanitize=fuzzer -x c++ - -o /dev/null 2>/dev/null; then
  echo "skipped: $compiler has no libFuzzer (Debian: clang with libclang-rt-dev or libclang-common-dev)"
  exit 0
fi

cd "$root"
CXX=$compiler cmake --preset fuzz >/dev/null
make -C "$build/tests/fuzz" --no-print-directory -j "$(nproc)" all
"$build/tests/fuzz/fuzz_corpus" "$build/corpus"
mkdir -p "$build/findings"
for program in "$build"/tests/fuzz/fuzz_*; do
  target=${program##*/fuzz_}
  [[ -f $program && -x $program && $target != corpus ]] || continue
  echo "$target, $seconds s"
  "$program" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=65536 -print_final_stats=1 -verbosity=0 -print_funcs=0 \
    -artifact_prefix="$build/findings/$target-" "$build/corpus/$target" 2>&1 |
    grep -a -v -e '^"' -e '^######' -e '^INFO' -e '^stat::\(average\|new_units\|slowest\|peak\)' || exit 1
done

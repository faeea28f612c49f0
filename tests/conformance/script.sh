#!/usr/bin/env bash
# What ./wheelhop promises, tried on a stand-in project that "builds" in no time.
set -uo pipefail

script=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
home="$work/a folder"
failures=0

check() { # check SENTENCE COMMAND...
  local sentence=$1
  shift
  if "$@"; then
    echo "ok: $sentence"
  else
    echo "FAILED: $sentence"
    echo '  stdout:' && sed 's/^/  | /' "$work/stdout" && echo '  stderr:' && sed 's/^/  | /' "$work/stderr"
    failures=$((failures + 1))
  fi
}
call() { # call ARGUMENT...: runs the script; sets `status`
  "$home/wheelhop" "$@" >"$work/stdout" 2>"$work/stderr" </dev/null
  status=$?
}
builds() { wc -l <"$home/build/count"; }
said() { grep -q -- "$1" "$work/stderr"; }
later() { touch -d '+1 second' "$@"; } # no waiting for the clock

mkdir -p "$home"/{core,variants,experiments,tests,bench,plots}
cp "$script" "$home/wheelhop"
cat >"$home/CMakePresets.json" <<'END'
{"version": 4,
 "configurePresets": [{"name": "release", "generator": "Unix Makefiles", "binaryDir": "${sourceDir}/build/release"}],
 "testPresets": [{"name": "release", "configurePreset": "release"}]}
END
cat >"$home/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.25)
project(stand_in LANGUAGES NONE)
enable_testing()
add_subdirectory(tests)
add_custom_target(wheelhop COMMAND sh ${CMAKE_SOURCE_DIR}/core/build.sh ${CMAKE_SOURCE_DIR}/build/count
                                      ${CMAKE_BINARY_DIR}/experiments)
END
cat >"$home/core/build.sh" <<'END'
echo built >>"$1"
mkdir -p "$2"
cat >"$2/wheelhop" <<'PROGRAM'
#!/bin/sh
echo "home=$WHEELHOP_HOME here=$PWD arguments=$*"
[ "$1" = exit ] && exit "$2"
exit 0
PROGRAM
chmod +x "$2/wheelhop"
END
cat >"$home/tests/CMakeLists.txt" <<'END'
add_custom_target(stand_in_tests ALL COMMAND ${CMAKE_COMMAND} -E touch ${CMAKE_BINARY_DIR}/tests_built)
add_test(NAME stand_in COMMAND ${CMAKE_COMMAND} -E md5sum ${CMAKE_BINARY_DIR}/tests_built)
END
export WHEELHOP_NO_INSTALL=1

check 'the script is valid bash' bash -n "$script"

cd "$work" || exit 1
call list 'two words'
check 'the first call builds, then runs the program with the same arguments' \
  grep -qxF "home=$home here=$work arguments=list two words" "$work/stdout"
check 'what it does is said on stderr' said 'building (first time'
check 'only the program is built for it' test ! -e "$home/build/release/tests_built"

call list
check 'a second call builds nothing' test "$(builds)" -eq 1
check 'a second call says nothing' test ! -s "$work/stderr"

call exit 7
check "the program's exit status comes back" test $status -eq 7

ln -s "$home/wheelhop" "$work/link"
"$work/link" >"$work/stdout" 2>"$work/stderr"
check 'a link to the script finds its folder' grep -qF "home=$home " "$work/stdout"

later "$home/core/build.sh"
call list
check 'an edited source is built again' test "$(builds)" -eq 2
check 'an edited source alone makes it build' said 'building'

# From here on the sources are in the past again.
touch -d '-1 hour' "$home"/core "$home"/core/build.sh
echo 'void f();' >"$home/core/new.hpp"
later "$home/core"
call list
check 'an added file is built' test "$(builds)" -eq 3
touch -d '-1 hour' "$home/core"
rm "$home/core/new.hpp"
later "$home/core"
call list
check 'a removed file is noticed' test "$(builds)" -eq 4
touch -d '-1 hour' "$home/core"

cp "$home/core/build.sh" "$work/good.sh"
printf 'echo "a telling error" >&2\nexit 1\n' >"$home/core/build.sh"
later "$home/core/build.sh"
call list --quiet
check 'a failed build exits with 1' test $status -eq 1
check 'a failed build shows the end of its log, --quiet or not' said 'a telling error'
check 'a failed build starts no program' test ! -s "$work/stdout"
touch -d '-1 hour' "$home/core/build.sh"
call list
check 'a failed build is not taken for a valid one' test $status -eq 1
cp "$work/good.sh" "$home/core/build.sh"
touch -d '-1 hour' "$home/core/build.sh" "$home/core"
call list
check 'a mended source builds' test $status -eq 0

before=$(builds)
rm "$home/build/release/.built-wheelhop"
for i in 1 2 3; do "$home/wheelhop" list >"$work/parallel.$i" 2>/dev/null & done
wait
check 'calls at the same time build once' test "$(builds)" -eq $((before + 1))
check 'calls at the same time all run the program' \
  test "$(cat "$work"/parallel.* | grep -c 'arguments=list')" -eq 3

mv "$home" "$work/moved"
home="$work/moved"
call list
check 'a moved folder is built anew' grep -qF "home=$home " "$work/stdout"

call test -R stand_in
check 'test builds the tests and passes' test $status -eq 0
check "test ends with ctest's summary" grep -q '100% tests passed' "$work/stdout"
call list
check 'after test the program is up to date too' test ! -s "$work/stderr"
call test -R absent
check 'no test found is a failure' test $status -eq 1

# Figure packages, with stand-ins for Node.js.
mkdir "$work/node"
echo '{}' >"$home/plots/package-lock.json"
printf '#!/bin/sh\necho v18.0.0\n' >"$work/node/node"
printf '#!/bin/sh\nexit 1\n' >"$work/node/npm"
chmod +x "$work"/node/*
searched=$PATH
PATH="$work/node:$PATH"
call list
check 'figure packages are left alone where no figure is drawn' test ! -s "$work/stderr"
call reproduce
check 'figure packages that cannot be installed are said to be left out' said 'left out'
check 'figure packages that cannot be installed do not stop the run' grep -q 'arguments=reproduce' "$work/stdout"
call reproduce
check 'what could not be installed is not tried again at once' said 'lately'
printf '#!/bin/sh\nmkdir -p "$3/node_modules" && : >"$3/node_modules/.package-lock.json"\n' >"$work/node/npm"
call report
check 'figure packages are installed' said 'npm ci'
call reproduce
check 'figure packages are installed once' test ! -s "$work/stderr"
rm "$home/plots/node_modules/.package-lock.json"
call diagnose --out d.json
check 'a diagnosis without a page needs none' test ! -s "$work/stderr"
call diagnose --out d.json --report=d.html
check 'a diagnosis with a page installs them' said 'npm ci'
printf '#!/bin/sh\necho v16.20.0\n' >"$work/node/node"
later "$home/plots/package-lock.json"
call reproduce
check 'an old Node.js is named' said 'Node.js 18 is needed, found 16'
PATH=$searched

# Packages, with stand-ins for Debian's tools: all are installed but one, and the lists do not know it at first.
if [[ -e /etc/debian_version ]]; then
  unset WHEELHOP_NO_INSTALL
  mkdir "$work/bin"
  cat >"$work/bin/dpkg-query" <<'END'
#!/bin/bash
shift 2
for package in "$@"; do [[ $package == libmatio-dev ]] || echo "installed $package"; done
END
  cat >"$work/bin/apt-cache" <<END
#!/bin/sh
[ -e "$work/updated" ] && echo 'Package: libmatio-dev'
exit 0
END
  cat >"$work/bin/apt-get" <<END
#!/bin/sh
echo "\$*" >>"$work/apt"
case "\$*" in *update) : >"$work/updated" ;; esac
exit 0
END
  printf '#!/bin/sh\n[ "$1" = -n ] && shift\nexec "$@"\n' >"$work/bin/sudo"
  chmod +x "$work"/bin/*
  PATH="$work/bin:$PATH"
  rm -f "$home"/build/release/.built-*
  call list
  check 'the missing package is named' said 'installing 1 Debian packages: libmatio-dev'
  check 'it alone is installed' grep -q -- '--no-install-recommends libmatio-dev$' "$work/apt"
  check 'unknown packages make it fetch the lists first' sh -c "sed -n 1p '$work/apt' | grep -q update"
  rm "$work/apt" "$home"/build/release/.built-*
  call list
  check 'known packages are installed without fetching the lists' test "$(grep -c update "$work/apt")" -eq 0
  printf '#!/bin/sh\necho "the mirror is gone"\nexit 100\n' >"$work/bin/apt-get"
  rm "$home"/build/release/.built-*
  call list
  check 'apt-get failing ends the call with its own words' said 'the mirror is gone'
  check 'apt-get failing exits with 1' test $status -eq 1
  if [[ $EUID -ne 0 ]]; then
    printf '#!/bin/sh\nexit 1\n' >"$work/bin/sudo"
    call list
    check 'without root the command to type is given' said 'sudo apt-get update && sudo apt-get install'
    check 'without root it exits with 2' test $status -eq 2
  fi
fi

echo "$failures failed"
exit $((failures > 0))

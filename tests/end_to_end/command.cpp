// The words of the program: help that teaches, and mistakes told with the command they belong to.
#include <catch2/catch.hpp>

#include "tests/support/program.hpp"

using namespace wheelhop::test;
using Catch::Contains;
using Catch::StartsWith;

TEST_CASE("help of every command tells how to use it, with an example") {
  const Said top = run_program("--help");
  CHECK(top.status == 0);
  for (const char* command :
       {"list", "generate", "identify", "simulate", "diagnose", "decide", "plan", "blind make", "blind run",
        "blind score", "blind calibrate", "reproduce", "sweep", "compare", "report"}) {
    CAPTURE(command);
    const Said said = run_program(std::string(command) + " --help");
    CHECK(said.status == 0);
    CHECK(said.err.empty());
    CHECK_THAT(said.out, Contains(std::string("Example:\n  wheelhop ") + command));
    CHECK_THAT(top.out, Contains(std::string(command).substr(0, std::string(command).find(' '))));
  }
}

TEST_CASE("a command that is none is told with the known ones, whatever it looks like") {
  CHECK(run_program("").status == 2);
  for (const char* words : {"identfy", "--identify"}) {
    const Said said = run_program(words);
    CHECK(said.status == 2);
    CHECK(said.lines() == 1);
    CHECK_THAT(said.err, Contains(words) && Contains("known commands: list, generate, identify"));
  }
  CHECK_THAT(run_program("identfy").err, Contains("did you mean \"identify\"?"));
  CHECK_THAT(run_program("blind mke").err, Contains("known commands: make, run, score"));
}

TEST_CASE("the version tells the commit that the build was configured at") {
  const Said said = run_program("--version");
  CHECK(said.status == 0);
  CHECK(said.err.empty());
  CHECK_THAT(said.out, StartsWith("wheelhop ") && Contains(", commit "));
}

TEST_CASE("a word that is missing or wrong is told with the help that knows it") {
  CHECK_THAT(run_program("blind make").err, StartsWith("wheelhop: CONFIG is required (wheelhop blind make --help)"));
  CHECK_THAT(run_program("blind").err, Contains("(wheelhop blind --help)"));
  const Said said = run_program("simulate m.json --records r.json --out s.csv --x0 tomorrow");
  CHECK(said.status == 2);
  CHECK(said.lines() == 1);
  CHECK_THAT(said.err, Contains("--x0") && Contains("tomorrow") && Contains("auto,estimate,zero"));
  CHECK(said.out.empty());
}

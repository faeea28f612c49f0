// The words of the program: help that teaches, and mistakes told with the command they belong to.
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <utility>

#include "tests/support/plants.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;
using Catch::StartsWith;

TEST_CASE("help of every command tells how to use it, with an example") {
  const Said top = run_program("--help");
  CHECK(top.status == 0);
  for (const char* command :
       {"list", "look", "generate", "identify", "simulate", "diagnose", "decide", "plan", "blind make", "blind run",
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
    CHECK_THAT(said.err, Contains(words) && Contains("known commands: list, look, generate, identify"));
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

TEST_CASE("what has no end is not read to its end, and --no-limits may stand before or behind the command") {
  const Said endless = run_program("decide /dev/zero");
  CHECK(endless.status == 2);
  CHECK(endless.lines() == 1);
  CHECK_THAT(endless.err, Contains("/dev/zero") && Contains("at most") && Contains("--no-limits"));
  for (const char* words :
       {"--no-limits decide none.json", "decide --no-limits none.json", "decide none.json --no-limits"}) {
    const Said said = run_program(words);
    CHECK(said.status == 2);
    CHECK_THAT(said.err, StartsWith("wheelhop: none.json: cannot read"));
  }
}

TEST_CASE("no command writes over what it reads, or twice into one file: refused before anything is read") {
  const Folder folder;
  // None of them is what it should be: a command that read before it looked would say so.
  for (const char* name : {"mine.plant.json", "r.json", "c.json", "m.json", "d.html", "key.json"})
    write_file(folder / name, "not JSON");
  std::filesystem::create_directory(folder / "there");
  std::filesystem::create_symlink(folder / "mine.plant.json", folder / "link.json");
  const auto before = folder.names();
  for (const char* words :
       {"diagnose --plant mine.plant.json --records r.json --out mine.json",
        "diagnose --plant mine.plant.json --records r.json --out r.json",
        "diagnose --plant mine.plant.json --records r.json --out link.json",
        "diagnose --plant mine.plant.json --records r.json --out d.json --report d.json",
        "diagnose --plant mine.plant.json --records r.json --out d.json --report there",
        "diagnose --plant mine.plant.json --records r.json --out d.json --report ./there/../r.json",
        "diagnose --plant mine.plant.json --records r.json --out nowhere/d.json",
        "plan --plant mine.plant.json --records r.json --out there/../mine.plant.json",
        "identify c.json --records r.json --out c.json", "identify c.json --records r.json --out there",
        "simulate m.json --records r.json --out r.json", "generate c.json --out c.json",
        "generate ./mine.plant.json --out mine.plant.json/x", "reproduce --config c.json --out r.json --quiet",
        "sweep c.json --out c.json", "report d.html", "report mine.plant.json --out link.json"}) {
    CAPTURE(words);
    const Said said = run_program(words, "-C '" + folder.path().string() + "'");
    CAPTURE(said.err);
    CHECK(said.status == 2);
    CHECK(said.lines() == 1);
    CHECK_THAT(said.err, Contains("expected") && !Contains("JSON"));
    CHECK(folder.names() == before);
    CHECK(read_file(folder / "mine.plant.json") == "not JSON");
  }
}

TEST_CASE("a seed that is no whole number from 0 on is refused, not wrapped") {
  for (const char* command : {"blind make c.json --out a --key b", "reproduce --out a"})
    for (const char* seed : {"-1", "-9223372036854775808", "1.5", "one"}) {
      CAPTURE(command, seed);
      const Said said = run_program(std::string(command) + " --seed=" + seed);
      CHECK(said.status == 2);
      CHECK(said.lines() == 1);
      CHECK_THAT(said.err, Contains("--seed"));
    }
}

TEST_CASE("a signal leaves one line that says how to go on") {
  const Folder folder;
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  for (const auto& [signal, status] : {std::pair{"INT", 130}, {"TERM", 143}}) {
    CAPTURE(signal);
    // Nobody writes the pipe: the command waits.
    const Said said = run_program("decide '" + (folder / "pipe").string() + "'",
                                  std::string("--default-signal=INT timeout --preserve-status -s ") + signal + " 3");
    CHECK(said.status == status);
    CHECK(said.lines() == 1);
    CHECK_THAT(said.err, StartsWith("wheelhop: stopped;") && Contains("start the same command again"));
  }
}

TEST_CASE("a result that is printed and cannot be is an error, and a file is written all the same without stdout") {
  const Folder folder;
  const std::string closed = R"(sh -c 'exec "$@" >&-' sh)", full = R"(sh -c 'exec "$@" >/dev/full' sh)";
  for (const std::string& where : {closed, full})
    for (const char* words : {"list", "list --json"}) {
      CAPTURE(where, words);
      const Said said = run_program(words, where);
      CHECK(said.status == 2);
      CHECK(said.lines() == 1);
      CHECK_THAT(said.err, StartsWith("wheelhop: stdout: "));
    }
  CHECK_THAT(run_program("plan --plant none.json --records none.json", closed).err, Contains("stdout"));
  CHECK_THAT(run_program("decide none.json", closed).err, Contains("stdout"));

  write_json(folder / "plant.json", parse_json(one_mass_text, "plant"));
  write_json(folder / "c.json", Json::parse(R"({"plant": "plant.json", "sampling_hz": 100, "records": [
    {"role": "estimation", "duration_s": 1, "drive": {"name": "multisine", "rms": 1, "period_s": 1, "from_hz": 1,
     "to_hz": 9}}]})"));
  const auto generate = [&](const std::string& out, const std::string& where) {
    return run_program(
        "generate --quiet '" + (folder / "c.json").string() + "' --out '" + (folder / out).string() + "'", where);
  };
  REQUIRE(generate("one", "").status == 0);
  REQUIRE(generate("two", R"(sh -c 'exec "$@" <&- >&- 2>&-' sh)").status == 0);
  for (const char* name : {"records.json", "provenance.json", "plant.json", "estimation_1.csv"})
    CHECK(read_file(folder / "one" / name) == read_file(folder / "two" / name));
}

TEST_CASE("a table whose name tells no format is refused before anything is read") {
  for (const char* out : {"out.xlsx", "out", "out.csv.zip"}) {
    const Said said = run_program(std::string("simulate none.json --records none.json --out ") + out);
    CHECK(said.status == 2);
    CHECK_THAT(said.err, Contains(out) && Contains(".csv, .csv.gz or .mat"));
  }
}

// What a user's mistake ends in: one message that says file, place, what was expected, what was found, and the names
// that are known. And files: whole or not at all.
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <fstream>
#include <map>
#include <thread>

#include "core/base/files.hpp"
#include "core/base/json.hpp"
#include "core/base/options.hpp"
#include "core/base/place.hpp"
#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "tests/kill/kill_at.hpp"
#include "tests/support/folder.hpp"

using namespace wheelhop;
using Catch::Contains;
using Catch::Equals;
namespace fs = std::filesystem;

namespace {

JsonCursor cursor(const std::string& text) { return JsonCursor::from(parse_json(text, "f.json"), "f.json"); }

struct Sample {
  double gain = 2;
  Index order = 4;
  bool centred = true;
  std::string method = "fast";
  std::string label = "none";

  template <class V>
  void fields(V&& visit) {
    visit("gain", gain, Range{0, 10}, "1", "a factor");
    visit("order", order, Range{1}, "1", "states");
    visit("centred", centred, "remove the mean");
    visit("method", method, Choices{{"fast", "exact"}}, "how");
    visit("label", label, Choices{}, "any text");
  }
};

}  // namespace

TEST_CASE("a syntax error names the source, the line and the column of the first wrong character") {
  CHECK_THROWS_WITH(parse_json("{\n  \"a\": 1,\n  \"b\" 2\n}", "f.json"), Contains("f.json: line 3, column 7"));
  CHECK_THROWS_WITH(parse_json("", "f.json"), Contains("f.json: line 1, column 1"));
  CHECK_THROWS_WITH(parse_json("[1, 2", "f.json"), Contains("line 1, column 6") && Contains("end of input"));
  CHECK_THROWS_WITH(parse_json("[1, 2,]", "f.json"), Contains("line 1, column 7"));
  CHECK_THROWS_WITH(parse_json("{} x", "f.json"), Contains("line 1, column 4"));
  CHECK_THROWS_WITH(parse_json("{\"a\": 1} // note", "f.json"), Contains("line 1, column 10"));
}

TEST_CASE("numbers that are not finite are refused however they are written") {
  for (const char* text : {"NaN", "Infinity", "-Infinity", "1e999", "-1e999", "nan", "+1", ".5", "0x10", "01"})
    CHECK_THROWS_AS(parse_json(text, "f.json"), UserError);
  CHECK_THROWS_WITH(parse_json("{\"a\":\n 1e999}", "f.json"), Contains("f.json: line 2") && Contains("1e999"));
  CHECK_THROWS_WITH(JsonCursor::from(Json(std::nan("")), "memory").number(), Contains("memory: $: expected a finite"));
}

TEST_CASE("a repeated key is refused at any depth and its second place is named") {
  CHECK_THROWS_WITH(parse_json("{\"a\": 1,\n \"a\": 2}", "f.json"),
                    Equals("f.json: line 2, column 2: expected each key once in an object, found \"a\" again"));
  CHECK_THROWS_WITH(parse_json("[{\"x\": {\"b\": [], \"b\": 1}}]", "f.json"),
                    Contains("column 18") && Contains("\"b\""));
  CHECK_THROWS_WITH(parse_json("{\"a\\\"\": 1, \"a\\\"\": 1}", "f.json"), Contains("column 12"));
  CHECK_NOTHROW(parse_json("{\"a\": {\"a\": 1}, \"b\": {\"a\": 1}}", "f.json"));
}

TEST_CASE("hostile JSON ends in a message, never in a crash") {
  CHECK_THROWS_AS(parse_json(std::string(1000000, '['), "f.json"), UserError);
  CHECK_THROWS_WITH(parse_json(std::string(201, '[') + std::string(201, ']'), "f.json"), Contains("200 nested levels"));
  CHECK_NOTHROW(parse_json(std::string(200, '[') + std::string(200, ']'), "f.json"));
  CHECK_THROWS_AS(parse_json("\"\xff\xfe\"", "f.json"), UserError);
  CHECK_THROWS_AS(parse_json(std::string("\0\0\0", 3), "f.json"), UserError);
  CHECK_THROWS_AS(parse_json("\"\\ud800\"", "f.json"), UserError);
  CHECK(parse_json("\xef\xbb\xbf{\"a\": 1}", "f.json")["a"] == 1);
}

TEST_CASE("the order of keys and every double survive writing and reading") {
  const std::string text = "{\"z\":1,\"a\":0.1,\"m\":[1e-308,-0.0,12345678901234567,1.7976931348623157e+308]}";
  const Json value = parse_json(text, "f.json");
  CHECK(value.begin().key() == "z");
  CHECK(parse_json(value.dump(), "again") == value);
  CHECK(value.dump() == text);
}

TEST_CASE("a wrong value is named with its path, what was expected and what was found") {
  const JsonCursor c =
      cursor(R"({"masses": [{"mass_kg": 1}, {"mass_kg": "heavy"}], "odd key": true, "n": 3.5, "big": 1e300})");
  CHECK_THROWS_WITH(c.at("masses").items()[1].at("mass_kg").number(),
                    Equals("f.json: $.masses[1].mass_kg: expected a number, found \"heavy\""));
  CHECK_THROWS_WITH(c.at("masses").items()[0].at("mass_kg").number(Range{2, 3}),
                    Equals("f.json: $.masses[0].mass_kg: expected a number in [2, 3], found 1"));
  CHECK_THROWS_WITH(c.at("odd key").number({0}), Contains("$[\"odd key\"]: expected a number >= 0, found true"));
  CHECK_THROWS_WITH(c.at("n").integer(1, 9), Contains("expected a whole number in [1, 9], found 3.5"));
  CHECK_THROWS_WITH(c.at("big").integer(), Contains("expected a whole number"));
  CHECK_THROWS_WITH(c.at("masses").string(), Contains("expected a string, found an array of 2"));
  CHECK_THROWS_WITH(c.items(), Contains("$: expected an array, found an object"));
  CHECK_THROWS_WITH(c.at("n").at("x"), Contains("$.n: expected an object, found 3.5"));
  CHECK_THROWS_WITH(c.at("n").boolean(), Contains("expected true or false"));
}

TEST_CASE("a name that holds a NUL is refused by its place, wherever the NUL stands") {
  for (const char* text : {R"({"file": "\u0000"})", R"({"file": "a\u0000.csv"})", R"({"file": "a.csv\u0000"})"})
    CHECK_THROWS_WITH(cursor(text).at("file").string(), Contains("f.json: $.file: expected a string without"));
  CHECK(cursor(R"({"file": "a\\u0000"})").at("file").string() == "a\\u0000");
}

TEST_CASE("whole numbers are read exactly and refused beyond their range") {
  CHECK(cursor("9223372036854775807").integer() == std::numeric_limits<Index>::max());
  CHECK(cursor("-9223372036854775808").integer() == std::numeric_limits<Index>::min());
  CHECK(cursor("4.0").integer() == 4);
  CHECK(cursor("1e6").integer() == 1000000);
  CHECK_THROWS_AS(cursor("9223372036854775808").integer(), UserError);
  CHECK_THROWS_AS(cursor("1e16").integer(), UserError);
  CHECK_THROWS_AS(cursor("-1").integer(0), UserError);
  CHECK_THROWS_AS(cursor("\"3\"").integer(), UserError);
}

TEST_CASE("a missing key names what is there and the name that may have been meant") {
  CHECK_THROWS_WITH(
      cursor(R"({"masskg": 1, "name": "a"})").at("mass_kg"),
      Equals("f.json: $: expected the key \"mass_kg\", found only: masskg, name; did you mean \"mass_kg\" "
             "by \"masskg\"?"));
  CHECK_THROWS_WITH(cursor("{}").at("mass_kg"), Contains("found an empty object"));
}

TEST_CASE("a key nobody asked for is refused with the known names") {
  const JsonCursor c = cursor(R"({"mass_kg": 1, "tolerence": 0.1})");
  c.at("mass_kg").number();
  c.find("tolerance");
  CHECK_THROWS_WITH(c.done(), Equals("f.json: $.tolerence: expected a known name, found \"tolerence\"; known names: "
                                     "mass_kg, tolerance; did you mean \"tolerance\"?"));
  c.has("tolerence");
  CHECK_NOTHROW(c.done());
  CHECK_THROWS_WITH(cursor("{\"a\": 1}").done(), Contains("known names: none"));
  CHECK_THROWS_WITH(cursor("[]").done(), Contains("expected an object"));
}

TEST_CASE("copies of a cursor share what was read") {
  const JsonCursor c = cursor(R"({"in": {"a": 1}})");
  c.at("in").at("a");
  CHECK_NOTHROW(c.at("in").done());
}

TEST_CASE("the nearest name forgives case, a letter and a unit suffix, and no more") {
  const std::vector<std::string> known = {"mass_kg", "stiffness_n_per_m", "name"};
  CHECK(nearest_name("mass", known) == "mass_kg");
  CHECK(nearest_name("Mass_Kg", known) == "mass_kg");
  CHECK(nearest_name("stifness_n_per_m", known) == "stiffness_n_per_m");
  CHECK(nearest_name("nmae", known) == "name");
  CHECK(nearest_name("x", known).empty());
  CHECK(nearest_name("", known).empty());
  CHECK(nearest_name("damping", known).empty());
  CHECK(nearest_name("name", {}).empty());
}

TEST_CASE("options read over their defaults, write back what was read, and list every field") {
  const JsonCursor c = cursor(R"({"gain": 3.5, "order": 7, "method": "exact", "label": "any thing"})");
  const Sample options = read_options<Sample>(c);
  c.done();
  CHECK(options.gain == 3.5);
  CHECK(options.order == 7);
  CHECK(options.centred);
  CHECK(options.label == "any thing");
  const Json written = write_options(options);
  CHECK(written.dump() == R"({"gain":3.5,"order":7,"centred":true,"method":"exact","label":"any thing"})");
  CHECK(write_options(read_options<Sample>(JsonCursor::from(written, "again"))) == written);
  const auto list = describe_options<Sample>();
  REQUIRE(list.size() == 5);
  CHECK(list[0].range == "[0, 10]");
  CHECK(list[1].range == ">= 1");
  CHECK(list[1].fallback == 4);
  CHECK(list[2].range == "true or false");
  CHECK(list[3].range == "fast | exact");
  CHECK(list[4].range == "any text");
}

TEST_CASE("options out of range and unknown choices are refused with the known names") {
  CHECK_THROWS_WITH(read_options<Sample>(cursor(R"({"gain": 11})")),
                    Contains("$.gain: expected a number in [0, 10], found 11"));
  CHECK_THROWS_WITH(read_options<Sample>(cursor(R"({"order": 0})")),
                    Contains("$.order: expected a whole number >= 1, found 0"));
  CHECK_THROWS_WITH(read_options<Sample>(cursor(R"({"method": "exakt"})")),
                    Equals("f.json: $.method: expected a known name, found \"exakt\"; known names: fast, exact; did "
                           "you mean \"exact\"?"));
  CHECK_THROWS_WITH(read_options<Sample>(cursor(R"({"label": 3})")), Contains("expected a string"));
}

TEST_CASE("a matrix survives JSON and a ragged one is refused") {
  const Matrix M = (Matrix(2, 3) << 1, 0.1, -3, 1e-300, 5, 6).finished();
  CHECK(matrix_from_json(JsonCursor::from(to_json(M), "m")) == M);
  CHECK(to_json((Matrix(1, 2) << 1, std::nan("")).finished()).dump() == "[[1.0,null]]");
  CHECK_THROWS_WITH(matrix_from_json(cursor("[[1, 2], [3]]")), Contains("$[1]: expected a row of 2 numbers"));
  CHECK_THROWS_WITH(matrix_from_json(cursor("[[1, null]]")), Contains("$[0][1]: expected a number, found null"));
  CHECK(matrix_from_json(cursor("[]")).size() == 0);
}

TEST_CASE("reading a file that is not there, or a folder, names it and says why") {
  const test::Folder folder;
  CHECK_THROWS_WITH(read_file(folder / "absent.json"), Contains("absent.json: cannot read: No such file"));
  CHECK_THROWS_WITH(read_file(folder.path()), Contains("expected a file, found a folder"));
  for (const char* name : {"records.json", "a.csv", ".hidden", "3", "2", "5", "4", "z"}) write_file(folder / name, "x");
  CHECK_THROWS_WITH(read_file(folder.path()),
                    Contains("found a folder with 2, 3, 4, 5, a.csv, records.json and ") && !Contains(".hidden"));
  CHECK_THROWS_WITH(JsonCursor::load(folder / "absent.json"), Contains("No such file"));
  write_file(folder / "empty.json", "");
  CHECK(read_file(folder / "empty.json").empty());
  CHECK_THROWS_WITH(JsonCursor::load(folder / "empty.json"), Contains("empty.json: line 1, column 1"));
  CHECK_FALSE(read_file("/proc/self/stat").empty());
}

namespace {

/// Limits of reading as a test needs them, put back at its end.
struct OtherLimits {
  explicit OtherLimits(ReadLimits limits) { read_limits() = limits; }
  ~OtherLimits() { read_limits() = {}; }
};

}  // namespace

TEST_CASE("a pipe is read to its end however slowly it comes, and a silent one is refused") {
  const test::Folder folder;
  const fs::path pipe = folder / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const OtherLimits limits({.stream_bytes = 1e5, .silence_s = 0.3});
  CHECK_THROWS_WITH(read_file(pipe), Contains("pipe: expected somebody to write") && Contains("--no-limits"));
  std::string content;
  {
    const std::jthread writer([&] {
      std::ofstream out(pipe);
      for (int i = 0; i < 6; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        out << i << std::flush;
      }
    });
    content = read_file(pipe);
  }
  CHECK(content == "012345");
}

TEST_CASE("a device or pipe that never ends is left at the limit, and one that ends before is read whole") {
  const OtherLimits limits({.stream_bytes = 1e5});
  CHECK_THROWS_WITH(read_file("/dev/zero"), Contains("/dev/zero: expected at most 100000 bytes"));
  CHECK(read_file("/dev/null").empty());
  const test::Folder folder;
  const fs::path pipe = folder / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const auto handler = signal(SIGPIPE, SIG_IGN);
  for (const std::size_t size : {std::size_t{0}, std::size_t{99999}, std::size_t{100000}, std::size_t{300000}}) {
    CAPTURE(size);
    const std::jthread writer([&] { std::ofstream(pipe) << std::string(size, 'x'); });
    if (size <= 100000)
      CHECK(read_file(pipe).size() == size);
    else
      CHECK_THROWS_AS(read_file(pipe), UserError);
  }
  signal(SIGPIPE, handler);
}

TEST_CASE("a file larger than the memory is refused by name before it is read") {
  const test::Folder folder;
  write_file(folder / "huge", "x");
  std::error_code error;
  fs::resize_file(folder / "huge", std::uintmax_t{1} << 42, error);
  if (error) {
    WARN("skipped: no sparse files here");
    return;
  }
  CHECK_THROWS_WITH(read_file(folder / "huge"), Contains("huge: cannot read: not enough memory"));
}

TEST_CASE("a write replaces the whole file and leaves nothing beside it") {
  const test::Folder folder;
  const std::string binary("\0\x01\r\n\xff", 5);
  write_file(folder / "a", std::string(100000, 'x'));
  write_file(folder / "a", binary);
  CHECK(read_file(folder / "a") == binary);
  CHECK(folder.names() == std::vector<std::string>{"a"});
  write_json(folder / "b.json", Json{{"x", 0.1}});
  CHECK(read_file(folder / "b.json") == "{\n  \"x\": 0.1\n}\n");
  CHECK(JsonCursor::load(folder / "b.json").directory() == folder.path());
}

TEST_CASE("a file that is replaced keeps its mode, and a new one has the usual") {
  const test::Folder folder;
  Random random(51, Stream::parameters);
  write_file(folder / "new", "x");
  const mode_t mask = ::umask(0);
  ::umask(mask);
  struct stat info {};
  REQUIRE(::stat((folder / "new").c_str(), &info) == 0);
  CHECK((info.st_mode & 07777) == (0666 & ~mask));
  for (int trial = 0; trial < 50; ++trial) {
    const auto mode = static_cast<mode_t>(0400 + random.integer(0400));
    REQUIRE(::chmod((folder / "new").c_str(), mode) == 0);
    write_file(folder / "new", std::to_string(trial));
    REQUIRE(::stat((folder / "new").c_str(), &info) == 0);
    CAPTURE(trial, mode);
    CHECK((info.st_mode & 07777) == mode);
    CHECK(read_file(folder / "new") == std::to_string(trial));
  }
}

TEST_CASE("a link is written through, not replaced") {
  const test::Folder folder;
  write_file(folder / "real", "old");
  fs::create_symlink(folder / "real", folder / "link");
  write_file(folder / "link", "new");
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(read_file(folder / "real") == "new");
}

TEST_CASE("a failed write keeps the old file, leaves nothing beside it, and says file and reason") {
  const test::Folder folder;
  write_file(folder / "a", "old");
  CHECK_THROWS_WITH(write_file(folder / "a" / "b", "x"), Contains("cannot write: Not a directory"));
  CHECK_THROWS_WITH(write_file(folder / "none" / "b", "x"), Contains("No such file"));
  CHECK_THROWS_WITH(write_file(folder.path(), "x"), Contains("Is a directory"));
  CHECK_THROWS_WITH(write_file("", "x"), Contains("cannot write"));
  CHECK_THROWS_AS(write_file("/proc/wheelhop_test", "x"), UserError);
  CHECK_THROWS_WITH(write_file("/dev/full", "x"), Equals("/dev/full: cannot write: No space left on device"));
  // A file size limit stands for the full disk: the first part is written, the rest is refused.
  struct rlimit before {};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  const struct rlimit small = {4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  std::string message;
  try {
    write_file(folder / "a", std::string(100000, 'x'));
  } catch (const UserError& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
  CHECK_THAT(message, Contains("a: cannot write: File too large"));
  CHECK(read_file(folder / "a") == "old");
  CHECK(folder.names() == std::vector<std::string>{"a"});
}

TEST_CASE("a set of files that is killed at any of its calls is whole or not there, never mixed") {
  constexpr int files = 6;
  const auto publish = [](const fs::path& place, int number) {
    StagedSet set(place, "index");
    for (int i = 0; i < files; ++i) write_file(set.path() / ("f" + std::to_string(i)), std::to_string(number));
    write_file(set.path() / "index", std::to_string(number));
    set.publish({"old"}, "f3");
  };
  enum class Before { nothing, empty_folder, set };
  for (const Before before : {Before::nothing, Before::empty_folder, Before::set}) {
    const bool replaces = before == Before::set;
    std::map<std::string, int> found;
    bool ended = false;
    int call = 0;
    while (!ended) {
      const test::Folder folder;
      const fs::path place = folder / "set";
      if (replaces) publish(place, 1);
      if (before == Before::empty_folder) fs::create_directory(place);
      ++call;
      const pid_t child = ::fork();
      if (child == 0) {
        test::kill_at_call(call);
        publish(place, 2);
        ::_exit(0);
      }
      int state = 0;
      REQUIRE(::waitpid(child, &state, 0) == child);
      ended = WIFEXITED(state);
      CAPTURE(static_cast<int>(before), call);
      if (before == Before::empty_folder) CHECK((fs::is_empty(place) || fs::exists(place / "index")));
      const std::string number = fs::exists(place / "index") ? read_file(place / "index") : "none";
      ++found[number];
      if (number != "none")
        for (int i = 0; i < files; ++i) CHECK(read_file(place / ("f" + std::to_string(i))) == number);
      publish(place, 3);
      remove_leftovers(place);
      remove_leftovers(folder.path());
      CHECK(read_file(place / "f0") == "3");
      CHECK(folder.names() == std::vector<std::string>{"set"});
      CHECK(std::distance(fs::directory_iterator(place), fs::directory_iterator()) == files + 1);
    }
    // Every file is written and renamed, and in a folder that was there every one is put into place by itself.
    CHECK(call > 2 * (files + 1) + (replaces ? files + 1 : 1));
    CHECK(found["2"] > 0);
    CHECK(found["none"] >= files);
    CHECK((found["1"] > 2 * files) == replaces);
  }
}

TEST_CASE("an empty folder that a set takes the place of keeps its mode, and one that cannot be replaced is filled") {
  const test::Folder folder;
  const fs::path place = folder / "set";
  fs::create_directory(place);
  fs::permissions(place, fs::perms::owner_all | fs::perms::group_read);
  const auto publish = [](const fs::path& where) {
    StagedSet set(where, "index");
    write_file(set.path() / "index", "whole");
    set.publish();
  };
  publish(place);
  CHECK(read_file(place / "index") == "whole");
  CHECK(fs::status(place).permissions() == (fs::perms::owner_all | fs::perms::group_read));
  fs::create_directory(folder / "elsewhere");
  fs::create_directory_symlink(folder / "elsewhere", folder / "link");
  publish(folder / "link");
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(read_file(folder / "elsewhere" / "index") == "whole");
  CHECK(folder.names() == std::vector<std::string>{"elsewhere", "link", "set"});
}

TEST_CASE("a set of files leaves what else stands in its folder, and nothing of a set that was given up") {
  const test::Folder folder;
  write_file(folder / "mine", "kept");
  write_file(folder / "old", "of an earlier set");
  {
    StagedSet set(folder.path(), "index");
    write_file(set.path() / "index", "half");
  }
  CHECK(folder.names() == std::vector<std::string>{"mine", "old"});
  StagedSet set(folder.path(), "index");
  write_file(set.path() / "index", "whole");
  set.publish({"old"});
  CHECK(read_file(folder / "index") == "whole");
  CHECK(read_file(folder / "mine") == "kept");
  CHECK_FALSE(fs::exists(folder / "old"));
}

TEST_CASE("what a process that has ended left half written is removed, and nothing else") {
  const test::Folder folder;
  const pid_t child = ::fork();
  if (child == 0) {
    write_file(temporary_beside(folder / "a.json"), "half");
    fs::create_directory(temporary_beside(folder / "set"));
    write_file(temporary_beside(folder / std::string(250, 'x')), "half");
    ::_exit(0);
  }
  int state = 0;
  REQUIRE(::waitpid(child, &state, 0) == child);
  REQUIRE(WEXITSTATUS(state) == 0);
  REQUIRE(folder.names().size() == 3);
  const std::string gone = std::to_string(child);
  const fs::path own = temporary_beside(folder / "a.json");
  std::vector<std::string> kept = {own.filename(), ".a.json.elsewhere-9." + gone + ".0.part", "a." + gone + ".0.part",
                                   ".a.json.part", ".hidden"};
  for (const std::string& name : kept) write_file(folder / name, "kept");
  remove_leftovers(folder.path());
  std::sort(kept.begin(), kept.end());
  CHECK(folder.names() == kept);
}

TEST_CASE("a fault of the machine is told from one of the name that was given") {
  const test::Folder folder;
  CHECK_THROWS_AS(write_file("/dev/full", "x"), MachineError);
  for (const fs::path& name : {folder / "absent", folder.path(), folder / std::string(300, 'x')}) {
    CAPTURE(name);
    bool of_the_name = false;
    try {
      read_file(name);
    } catch (const MachineError&) {
    } catch (const UserError&) {
      of_the_name = true;
    }
    CHECK(of_the_name);
  }
  write_file(folder / "a", "x");
  struct rlimit before {};
  getrlimit(RLIMIT_NOFILE, &before);
  const struct rlimit none = {0, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  bool of_the_machine = false;
  try {
    read_file(folder / "a");
  } catch (const MachineError&) {
    of_the_machine = true;
  }
  setrlimit(RLIMIT_NOFILE, &before);
  CHECK(of_the_machine);
}

TEST_CASE("writers of one file at the same time leave one of their versions, whole") {
  const test::Folder folder;
  std::vector<std::thread> writers;
  for (char c = 'a'; c < 'e'; ++c)
    writers.emplace_back([&folder, c] {
      for (int i = 0; i < 10; ++i) write_file(folder / "f", std::string(50000, c));
    });
  for (std::thread& writer : writers) writer.join();
  const std::string content = read_file(folder / "f");
  CHECK(content == std::string(50000, content.at(0)));
  CHECK(folder.names().size() == 1);
}

TEST_CASE("an output folder is made with its parents, and one that cannot be is refused at once") {
  const test::Folder folder;
  CHECK_NOTHROW(require_writable_folder(folder / "x" / "y"));
  CHECK(fs::is_empty(folder / "x" / "y"));
  CHECK_NOTHROW(require_writable_folder(folder / "x" / "y"));
  write_file(folder / "file", "");
  CHECK_THROWS_WITH(require_writable_folder(folder / "file"), Contains("file: cannot"));
  CHECK_THROWS_WITH(require_writable_folder(folder / "file" / "y"), Contains("Not a directory"));
  CHECK_THROWS_WITH(require_writable_folder("/proc/wheelhop_test"), Contains("/proc/wheelhop_test: cannot"));
  CHECK_THROWS_WITH(require_writable_folder("/proc/self"), Contains("cannot write into the folder"));
}

TEST_CASE("the text of a place is read back as what it is, whatever a part is called") {
  for (const auto& [text, kind] : {std::pair{"suspension", PlaceKind::part},
                                   {"actuator_arm", PlaceKind::part},
                                   {"timebase_2", PlaceKind::part},
                                   {"guide:wheel", PlaceKind::guide},
                                   {"sensor:travel", PlaceKind::sensor},
                                   {"actuator", PlaceKind::actuator},
                                   {"actuator:road_front", PlaceKind::actuator},
                                   {"timebase", PlaceKind::timebase}}) {
    CAPTURE(text);
    const Place place = place_from(text);
    CHECK(place.kind == kind);
    CHECK(to_string(place) == text);
    CHECK(is_path(place) == (kind != PlaceKind::part && kind != PlaceKind::guide));
  }
  CHECK(guide_place("a") != part_place("guide:a"));
  CHECK((guide_place("a") < part_place("guide:a")) != (part_place("guide:a") < guide_place("a")));
  CHECK(part_place("b") < guide_place("a"));
  CHECK(EffectAt{"bias", part_place("z")} < EffectAt{"bump_stop", part_place("a")});
  CHECK(without_guide(guide_place("wheel")) == part_place("wheel"));
  for (const Place& other : {part_place("wheel"), sensor_place("wheel"), clock_place()})
    CHECK(without_guide(other) == other);
}

// Tables of measurements in files: CSV, gzip and MAT, whole, damaged and foreign.
#include "core/data/table.hpp"

#include <fmt/format.h>
#include <matio.h>
#include <zlib.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "core/data/csv.hpp"
#include "core/data/gzip.hpp"
#include "core/data/mat.hpp"
#include "tests/support/folder.hpp"

using namespace wheelhop;
using Catch::Contains;
using Catch::Equals;
namespace fs = std::filesystem;

namespace {

Table csv(const std::string& text) { return parse_csv(text, "f.csv"); }

std::string some_text(int samples) {
  std::string text = "t,u,y\n";
  for (int k = 0; k < samples; ++k) text += fmt::format("{},{},{}\n", k / 200.0, k, 10 - 3 * k);
  return text;
}

}  // namespace

TEST_CASE("a CSV is read by name with byte order mark, CR LF, quotes, spaces and blank lines at the end") {
  const Table table =
      csv("\xef\xbb\xbf\"t\", road ,\"a,b\",\"say \"\"so\"\"\"\r\n0,1e3,-.5,+2\r\n 0.1 ,\"2\",3.,4\r\n\r\n \n");
  CHECK(table.names == std::vector<std::string>{"t", "road", "a,b", "say \"so\""});
  REQUIRE(table.columns.cols() == 2);
  CHECK(table.columns.col(0) == (Vector(4) << 0, 1000, -0.5, 2).finished());
  CHECK(table.columns.col(1) == (Vector(4) << 0.1, 2, 3, 4).finished());
  CHECK(table.find("road") == 1);
  CHECK(table.find("nothing") == -1);
  CHECK(csv("a\n1").columns(0, 0) == 1);
  CHECK(csv("a\n1e-400\n").columns(0, 0) == 0);
  CHECK(csv("a\n4.9e-324\n").columns(0, 0) > 0);
}

TEST_CASE("a broken CSV is refused with file, line and column") {
  CHECK_THROWS_WITH(csv(""), Equals("f.csv: expected a line of names, found an empty file"));
  CHECK_THROWS_WITH(csv("\n \r\n"), Contains("found an empty file"));
  CHECK_THROWS_WITH(csv("\xef\xbb\xbf"), Contains("found an empty file"));
  CHECK_THROWS_WITH(csv("a,b\n"), Equals("f.csv: line 2, column 1: expected a sample, found the end of the file"));
  CHECK_THROWS_WITH(csv("a,b\n1,2\n3\n"), Equals("f.csv: line 3, column 2: expected 2 cells, found 1"));
  CHECK_THROWS_WITH(csv("a,b\n1,2,3\n"), Equals("f.csv: line 2, column 5: expected 2 cells, found 3"));
  CHECK_THROWS_WITH(csv("a,b\n1,2,\n"), Contains("line 2, column 5: expected 2 cells, found 3"));
  CHECK_THROWS_WITH(csv("a,b\n1,x\n"), Equals("f.csv: line 2, column 3: expected a number for \"b\", found \"x\""));
  CHECK_THROWS_WITH(csv("a,b\n1,2 3\n"), Contains("found \"2 3\""));
  CHECK_THROWS_WITH(csv("a,b\n1,0x10\n"), Contains("line 2, column 3: expected a number"));
  CHECK_THROWS_WITH(csv("a,b\n1,1.5kg\n"), Contains("line 2, column 3: expected a number"));
  CHECK_THROWS_WITH(csv("a,b\n1,\n"),
                    Equals("f.csv: line 2, column 3: expected a number for \"b\", found an empty cell"));
  CHECK_THROWS_WITH(csv("a,b\n,1\n"), Contains("line 2, column 1: expected a number for \"a\", found an empty cell"));
  for (const char* cell : {"NaN", "nan", "inf", "-Infinity", "1e400", "-1e999"})
    CHECK_THROWS_WITH(csv(fmt::format("a,b\n1,2\n3,{}\n", cell)),
                      Contains("line 3, column 3: expected a finite number for \"b\""));
  CHECK_THROWS_WITH(csv("a,b\n1,2\n\n3,4\n"), Contains("line 3, column 1: expected a sample, found a blank line"));
}

TEST_CASE("a broken header is refused with the place of the name") {
  CHECK_THROWS_WITH(csv("a,b,a\n1,2,3\n"),
                    Equals("f.csv: line 1, column 5: expected each name once, found \"a\" again"));
  CHECK_THROWS_WITH(csv("a,,b\n1,2,3\n"), Contains("line 1, column 3: expected a name for channel 2"));
  CHECK_THROWS_WITH(csv("a,b,\n1,2,3\n"), Contains("line 1, column 5: expected a name for channel 3"));
  CHECK_THROWS_WITH(csv("0,1.5\n1,2\n"), Contains("expected a header line of names, found numbers"));
  CHECK_THROWS_WITH(csv("t;road\n1;2\n"), Contains("separated by commas"));
  CHECK_THROWS_WITH(csv("\"a,b\n1,2\n"), Contains("expected a closing quote"));
}

TEST_CASE("binary content and folders under a CSV name are refused, whatever the bytes") {
  CHECK_THROWS_WITH(csv(std::string("\x7f"
                                    "ELF\x02\x01\0\0",
                                    8)),
                    Contains("binary content"));
  CHECK_THROWS_AS(csv(std::string(1000, '\0')), UserError);
  Random random(1, Stream::noise);
  for (int i = 0; i < 2000; ++i) {
    std::string junk = i % 2 ? "a,b\n1,2\n" : "";
    for (Index k = random.integer(60); k >= 0; --k) junk += static_cast<char>(random.integer(256));
    try {
      const Table table = csv(junk);
      CHECK(all_finite(table.columns));
      CHECK(table.columns.rows() == static_cast<Index>(table.names.size()));
    } catch (const UserError&) {
    }
  }
  const test::Folder folder;
  fs::create_directory(folder / "x.csv");
  CHECK_THROWS_WITH(read_table(folder / "x.csv"), Contains("expected a file, found a folder"));
  CHECK_THROWS_WITH(read_table(folder / "none.csv"), Contains("No such file"));
  CHECK_THROWS_WITH(read_table(folder / "a.xlsx"), Contains("expected a file name ending in .csv, .csv.gz or .mat"));
}

TEST_CASE(
    "every finite double survives CSV, compressed CSV and MAT bit for bit, and the bytes are the same every time") {
  const test::Folder folder;
  Table table;
  table.names = {"t", "x_1", "y"};
  table.columns = Random(3, Stream::noise).normal(3, 500);
  table.columns.col(0) << 0.1, -0.0, 1.7976931348623157e308;
  table.columns.col(1) << 5e-324, 1e22, 123456789012345678.0;
  for (const char* name : {"a.csv", "a.csv.gz", "A.CSV.GZ", "a.mat"}) {
    write_table(folder / name, table);
    const Table again = read_table(folder / name);
    CHECK(again.names == table.names);
    REQUIRE(again.columns.size() == table.columns.size());
    CHECK(std::memcmp(again.columns.data(), table.columns.data(), sizeof(double) * 1500) == 0);
    const std::string bytes = read_file(folder / name);
    write_table(folder / name, table);
    CHECK(read_file(folder / name) == bytes);
  }
  CHECK(folder.names() == std::vector<std::string>{"A.CSV.GZ", "a.csv", "a.csv.gz", "a.mat"});
  table.names[1] = " odd, \"name\"";
  write_csv(folder / "a.csv", table);
  CHECK(read_csv(folder / "a.csv").names == std::vector<std::string>{"t", " odd, \"name\"", "y"});
  table.columns(2, 7) = std::nan("");
  CHECK_THROWS_WITH(write_table(folder / "b.csv", table), Contains("channel \"y\" is not finite at sample 7"));
  CHECK_FALSE(fs::exists(folder / "b.csv"));
}

TEST_CASE("a damaged gzip stream is refused at every length and for every flipped byte that matters") {
  const test::Folder folder;
  const std::string text = some_text(300);
  const std::string packed = pack_gzip(text);
  CHECK(unpack_gzip(packed, "f") == text);
  CHECK(unpack_gzip(packed + packed, "f") == text + text);
  CHECK(unpack_gzip(packed + std::string(512, '\0'), "f") == text);
  CHECK(unpack_gzip(pack_gzip(""), "f").empty());
  for (std::size_t length = 0; length < packed.size(); length += 1 + length / 50)
    CHECK_THROWS_AS(unpack_gzip(packed.substr(0, length), "f"), UserError);
  CHECK_THROWS_WITH(unpack_gzip(packed.substr(0, packed.size() / 2), "f"), Contains("f: truncated"));
  for (std::size_t place = 10; place < packed.size(); place += 13) {
    std::string bad = packed;
    bad[place] = static_cast<char>(bad[place] ^ 0x20);
    CHECK_THROWS_AS(unpack_gzip(bad, "f"), UserError);
  }
  CHECK_THROWS_WITH(unpack_gzip(packed + "junk", "f"), Contains("content after the gzip stream"));
  write_file(folder / "plain.csv.gz", text);
  CHECK_THROWS_WITH(read_table(folder / "plain.csv.gz"), Contains("plain.csv.gz: expected a gzip stream"));
  write_file(folder / "packed.csv", packed);
  CHECK_THROWS_WITH(read_table(folder / "packed.csv"),
                    Contains("packed.csv: line 1, column 1: expected a line of names, found binary"));
}

TEST_CASE("a long CSV is read whole, line by line what was written") {
  std::string text = "t,u,y\n";
  Random random(1, Stream::noise);
  Matrix written = random.normal(3, 131072);
  for (const auto& line : written.colwise()) text += fmt::format("{},{},{}\n", line(0), line(1), line(2));
  CHECK(csv(text).columns == written);
}

namespace {

/// Writes one MAT variable of any kind.
void put(mat_t* file, const char* name, matio_classes kind, matio_types type, std::vector<std::size_t> dims,
         const void* data, int options = 0) {
  matvar_t* variable =
      Mat_VarCreate(name, kind, type, static_cast<int>(dims.size()), dims.data(), const_cast<void*>(data), options);
  REQUIRE(variable != nullptr);
  REQUIRE(Mat_VarWrite(file, variable, MAT_COMPRESSION_ZLIB) == 0);
  Mat_VarFree(variable);
}

void make_mat(const fs::path& path, const std::function<void(mat_t*)>& fill) {
  mat_t* file = Mat_CreateVer(path.c_str(), nullptr, MAT_FT_MAT5);
  REQUIRE(file != nullptr);
  fill(file);
  Mat_Close(file);
}

}  // namespace

TEST_CASE("MAT vectors are read whatever their number type and direction, among other variables") {
  const test::Folder folder;
  const double t[] = {0, 0.5, 1};
  const float single[] = {0.5f, -1, 2};
  const std::int16_t whole[] = {-3, 4, 32000};
  const std::uint8_t bytes[] = {0, 255, 7};
  make_mat(folder / "a.mat", [&](mat_t* f) {
    put(f, "note", MAT_C_CHAR, MAT_T_UINT8, {1, 5}, "hello");
    put(f, "t", MAT_C_DOUBLE, MAT_T_DOUBLE, {3, 1}, t);
    put(f, "single", MAT_C_SINGLE, MAT_T_SINGLE, {1, 3}, single);
    put(f, "whole", MAT_C_INT16, MAT_T_INT16, {1, 3}, whole);
    put(f, "bytes", MAT_C_UINT8, MAT_T_UINT8, {3, 1}, bytes);
  });
  const Table table = read_table(folder / "a.mat", {"whole", "t", "single", "bytes"});
  CHECK(table.names[0] == "whole");
  const Matrix expected = (Matrix(4, 3) << -3, 4, 32000, 0, 0.5, 1, 0.5, -1, 2, 0, 255, 7).finished();
  CHECK(table.columns == expected);
  CHECK_THROWS_WITH(read_table(folder / "a.mat"), Contains("variable \"note\": expected a vector of numbers"));
  CHECK_THROWS_WITH(read_table(folder / "a.mat", {"road"}),
                    Contains("variable \"road\": not there; known names: note, t, single"));
}

TEST_CASE("MAT vectors that another library packed are read at every length") {
  const test::Folder folder;
  const std::vector<std::uint8_t> bytes(40, 3);
  const std::vector<std::int16_t> whole(40, -5);
  const std::vector<float> single(40, 0.5f);
  const std::vector<double> numbers(40, 0.1);
  for (std::size_t n = 1; n <= 40; ++n) {
    CAPTURE(n);
    make_mat(folder / "a.mat", [&](mat_t* f) {
      put(f, "bytes", MAT_C_UINT8, MAT_T_UINT8, {n, 1}, bytes.data());
      put(f, "whole", MAT_C_INT16, MAT_T_INT16, {1, n}, whole.data());
      put(f, "single", MAT_C_SINGLE, MAT_T_SINGLE, {n, 1}, single.data());
      put(f, "a_longer_name", MAT_C_DOUBLE, MAT_T_DOUBLE, {1, n}, numbers.data());
    });
    const Table table = read_mat(folder / "a.mat");
    const Vector first = table.columns.col(0), last = table.columns.col(static_cast<Index>(n) - 1);
    CHECK(first == (Vector(4) << 3, -5, 0.5, 0.1).finished());
    CHECK(last == first);
  }
}

TEST_CASE("MAT variables that are no real finite vectors of one length are refused by name") {
  const test::Folder folder;
  double re[] = {1, 2, 3, 4}, im[] = {0, 1, 0, 1}, bad[] = {1, std::nan(""), 3, 4};
  mat_complex_split_t z = {re, im};
  make_mat(folder / "a.mat", [&](mat_t* f) {
    put(f, "t", MAT_C_DOUBLE, MAT_T_DOUBLE, {4, 1}, re);
    put(f, "z", MAT_C_DOUBLE, MAT_T_DOUBLE, {4, 1}, &z, MAT_F_COMPLEX);
    put(f, "m", MAT_C_DOUBLE, MAT_T_DOUBLE, {2, 2}, re);
    put(f, "s", MAT_C_DOUBLE, MAT_T_DOUBLE, {3, 1}, re);
    put(f, "n", MAT_C_DOUBLE, MAT_T_DOUBLE, {4, 1}, bad);
    put(f, "e", MAT_C_DOUBLE, MAT_T_DOUBLE, {0, 0}, re);
  });
  CHECK_THROWS_WITH(read_mat(folder / "a.mat", {"t", "z"}), Contains("variable \"z\": expected real numbers"));
  CHECK_THROWS_WITH(read_mat(folder / "a.mat", {"t", "m"}),
                    Contains("variable \"m\": expected a vector, found a matrix"));
  CHECK_THROWS_WITH(read_mat(folder / "a.mat", {"t", "s"}),
                    Contains("variable \"s\": expected 4 values as in \"t\", found 3"));
  CHECK_THROWS_WITH(read_mat(folder / "a.mat", {"t", "n"}),
                    Contains("variable \"n\": expected finite numbers, found nan at sample 1"));
  CHECK_THROWS_WITH(read_mat(folder / "a.mat", {"t", "e"}),
                    Contains("variable \"e\": expected a vector, found an empty"));
  const Table table{{"ok", "not ok"}, Matrix::Zero(2, 3)};
  CHECK_THROWS_WITH(write_mat(folder / "b.mat", table),
                    Contains("variable \"not ok\": expected a name MATLAB accepts"));
  CHECK_THROWS_WITH(write_mat(folder / "none" / "b.mat", {{"t"}, Matrix::Zero(1, 3)}),
                    Contains("cannot write: No such file"));
}

TEST_CASE("a file that is no MAT file, or a truncated one, is refused") {
  const test::Folder folder;
  write_file(folder / "empty.mat", "");
  CHECK_THROWS_WITH(read_table(folder / "empty.mat"), Contains("found an empty file"));
  write_file(folder / "text.mat", some_text(50));
  CHECK_THROWS_AS(read_table(folder / "text.mat"), UserError);
  write_mat(folder / "good.mat", {{"t", "u"}, Matrix::Random(2, 50)});
  const std::vector<double> ramp(500, 0.25);
  make_mat(folder / "packed.mat", [&](mat_t* f) {
    put(f, "t", MAT_C_DOUBLE, MAT_T_DOUBLE, {500, 1}, ramp.data());
    put(f, "u", MAT_C_DOUBLE, MAT_T_DOUBLE, {500, 1}, ramp.data());
  });
  for (const char* name : {"good.mat", "packed.mat"}) {
    const std::string good = read_file(folder / name);
    CHECK_NOTHROW(read_table(folder / name, {"t", "u"}));
    for (std::size_t length = 1; length < good.size(); length += 31) {
      write_file(folder / "cut.mat", good.substr(0, length));
      CHECK_THROWS_AS(read_table(folder / "cut.mat", {"t", "u"}), UserError);
    }
  }
  // Any damaged byte: refused or read, never a crash and never a number that is not finite.
  for (const char* name : {"good.mat", "packed.mat"}) {
    const std::string good = read_file(folder / name);
    for (std::size_t place = 0; place < good.size(); place += good.size() / 60 + 1) {
      std::string bad = good;
      bad[place] = static_cast<char>(bad[place] ^ 0xff);
      write_file(folder / "bad.mat", bad);
      try {
        const Table table = read_table(folder / "bad.mat", {"t", "u"});
        CHECK(all_finite(table.columns));
      } catch (const UserError&) {
      }
    }
  }
}

namespace {

/// A MAT file by its bytes, in any order of bytes, of vectors that may lie about themselves.
class MatText {
 public:
  explicit MatText(bool big) : big_(big) {
    text_ = "MATLAB 5.0 MAT-file";
    text_.resize(124, ' ');
    text_ += big ? std::string("\1\0MI", 4) : std::string("\0\1IM", 4);
  }

  template <class Number>
  std::string number(Number value) const {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    if (big_) std::reverse(bytes.begin(), bytes.end());
    return bytes;
  }

  /// @param declared size in the tag; -1: the true one
  std::string element(std::uint32_t kind, const std::string& content, std::int64_t declared = -1) const {
    const auto size = static_cast<std::uint32_t>(declared < 0 ? static_cast<std::int64_t>(content.size()) : declared);
    if (size > 0 && size <= 4 && declared < 0)
      return number<std::uint32_t>(kind | size << 16) + content + std::string(4 - size, '\0');
    return number<std::uint32_t>(kind) + number<std::uint32_t>(size) + content +
           std::string((8 - content.size() % 8) % 8, '\0');
  }

  /// A vector called `name` with these values, of class double. @param sides as declared
  template <class Number>
  std::string vector(const std::string& name, std::uint32_t kind, const std::vector<Number>& values,
                     std::pair<std::int32_t, std::int32_t> sides, std::int64_t declared = -1) const {
    std::string content;
    for (const Number value : values) content += number(value);
    return element(6, number<std::uint32_t>(6) + number<std::uint32_t>(0)) +
           element(5, number(sides.first) + number(sides.second)) + element(1, name) + element(kind, content, declared);
  }

  void add(const std::string& variable, bool packed, std::int64_t declared = -1) {
    const std::string whole =
        number<std::uint32_t>(14) +
        number(static_cast<std::uint32_t>(declared < 0 ? static_cast<std::int64_t>(variable.size()) : declared)) +
        variable;
    if (!packed) {
      text_ += whole;
      return;
    }
    uLongf size = ::compressBound(whole.size());
    std::string small(size, '\0');
    REQUIRE(::compress(reinterpret_cast<Bytef*>(small.data()), &size, reinterpret_cast<const Bytef*>(whole.data()),
                       whole.size()) == Z_OK);
    text_ += number<std::uint32_t>(15) + number(static_cast<std::uint32_t>(size)) + small.substr(0, size);
  }

  const std::string& text() const { return text_; }

 private:
  bool big_;
  std::string text_;
};

template <class Number>
void check_storage(std::uint32_t kind, Random& random) {
  const test::Folder folder;
  for (const bool big : {false, true})
    for (const bool packed : {false, true}) {
      MatText file(big);
      const Index count = 1 + random.integer(9);
      std::vector<Number> values;
      for (Index k = 0; k < count; ++k) values.push_back(static_cast<Number>(random.integer(120)));
      const auto length = static_cast<std::int32_t>(count);
      file.add(file.vector("other", 9, std::vector<double>{1, 2}, {1, 2}), packed);
      file.add(file.vector("x", kind, values, random.integer(2) ? std::pair(length, 1) : std::pair(1, length)), packed);
      write_file(folder / "a.mat", file.text());
      CAPTURE(kind, big, packed, count);
      const Table table = read_mat(folder / "a.mat", {"x"});
      REQUIRE(table.columns.cols() == count);
      for (Index k = 0; k < count; ++k)
        CHECK(table.columns(0, k) == static_cast<double>(values[static_cast<std::size_t>(k)]));
    }
}

}  // namespace

TEST_CASE("MAT vectors are read in every type of storage, in both orders of bytes, packed and not") {
  Random random(21, Stream::noise);
  for (int i = 0; i < 5; ++i) {
    check_storage<std::int8_t>(1, random);
    check_storage<std::uint8_t>(2, random);
    check_storage<std::int16_t>(3, random);
    check_storage<std::uint16_t>(4, random);
    check_storage<std::int32_t>(5, random);
    check_storage<std::uint32_t>(6, random);
    check_storage<float>(7, random);
    check_storage<double>(9, random);
    check_storage<std::int64_t>(12, random);
    check_storage<std::uint64_t>(13, random);
  }
}

TEST_CASE("a MAT variable that declares more or fewer values than it holds is refused, wherever it says so") {
  const test::Folder folder;
  Random random(22, Stream::noise);
  for (int trial = 0; trial < 200; ++trial) {
    MatText file(random.integer(2) != 0);
    const bool packed = random.integer(2) != 0;
    const auto count = static_cast<std::int32_t>(1 + random.integer(50));
    const std::vector<double> values(static_cast<std::size_t>(count), 0.25);
    const auto more = static_cast<std::int32_t>(1 + random.integer(trial % 2 ? 10 : 1000000000));
    std::pair<std::int32_t, std::int32_t> sides(count, 1);
    std::int64_t inner = -1, outer = -1;
    const auto kind = random.integer(5);
    if (kind == 0) sides.first += more;
    if (kind == 1) inner = 8 * (static_cast<std::int64_t>(count) + more % 100000000);
    if (kind == 2) sides = {count + more % 100000000, 1}, inner = 8 * static_cast<std::int64_t>(sides.first);
    if (kind == 3) outer = 200 + 8 * static_cast<std::int64_t>(count) + more;
    if (kind == 4) sides = {-count, 1};
    CAPTURE(trial, kind, packed, count, more);
    file.add(file.vector("x", 9, values, sides, inner), packed, outer);
    write_file(folder / "lie.mat", file.text());
    CHECK_THROWS_AS(read_mat(folder / "lie.mat", {"x"}), UserError);
    CHECK_THROWS_WITH(read_mat(folder / "lie.mat"), Contains("lie.mat"));
  }
}

TEST_CASE("what unpacks to far more than its size is refused, with the way to lift the limit, and read once lifted") {
  const test::Folder folder;
  const std::vector<double> zeros(1 << 20, 0.0);
  MatText file(false);
  file.add(file.vector("x", 9, zeros, {1 << 20, 1}), true);
  write_file(folder / "a.mat", file.text());
  std::string text = "x\n";
  for (int k = 0; k < 1 << 20; ++k) text += "0000000\n";
  write_file(folder / "a.csv.gz", pack_gzip(text));
  const auto reads = [&](double bytes, double ratio) {
    read_limits().unpacked_bytes = bytes;
    read_limits().unpacked_ratio = ratio;
    int count = 0;
    for (const char* name : {"a.mat", "a.csv.gz"}) try {
        count += read_table(folder / name).columns.cols() == 1 << 20;
      } catch (const UserError& error) {
        CHECK_THAT(error.what(), Contains(name) && Contains("expected at most") && Contains("--no-limits"));
      }
    read_limits() = {};
    return count;
  };
  CHECK(reads(1e5, 16) == 0);
  CHECK(reads(1e5, 2000) == 2);
  CHECK(reads(1e7, 16) == 2);
  CHECK(reads(std::numeric_limits<double>::infinity(), 1) == 2);
  CHECK(read_table(folder / "a.mat").columns.isZero());
}

TEST_CASE("a MAT file of version 7.3 is refused with the way to save it") {
  const test::Folder folder;
  std::string header = "MATLAB 7.3 MAT-file";
  header.resize(124, ' ');
  write_file(folder / "a.mat", header + std::string("\0\2IM", 4) + "\x89HDF");
  CHECK_THROWS_WITH(read_table(folder / "a.mat"), Contains("version 5 (save -v6 or -v7), found version 7.3"));
}

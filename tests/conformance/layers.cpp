// The layers of the house: includes point down only.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace {

/// From the bottom up; a folder may include itself and what stands before it.
const std::vector<std::string> kLayers = {
    "core/base/",     "core/data/",    "core/plant/",       "core/model/",        "core/kernels/",   "core/optimise/",
    "core/identify/", "core/greybox/", "core/gap/verdict/", "core/gap/evidence/", "core/gap/where/", "core/gap/which/",
    "core/gap/plan/", "core/gap/",     "core/gap/study/",   "variants/",          "experiments/"};

/// Position in kLayers of the innermost folder that holds a path, -1 for none.
int layer_of(const std::string& path) {
  int innermost = -1;
  for (std::size_t i = 0; i < kLayers.size(); ++i)
    if (path.starts_with(kLayers[i]) &&
        (innermost < 0 || kLayers[i].size() > kLayers[static_cast<std::size_t>(innermost)].size()))
      innermost = static_cast<int>(i);
  return innermost;
}

/// "variants/inversion/" of a path in a family's folder, empty for the tables' shared files.
std::string family_of(const std::string& path) {
  const std::size_t first = path.find('/'), second = path.find('/', first + 1);
  return path.starts_with("variants/") && second != std::string::npos ? path.substr(0, second + 1) : "";
}

}  // namespace

TEST_CASE("no file includes a layer above its own, and no family of pieces includes another") {
  const std::filesystem::path root = WHEELHOP_SOURCE;
  int files = 0, includes = 0;
  for (const char* top : {"core", "variants", "experiments"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".hpp" && extension != ".cpp") continue;
      const std::string path = std::filesystem::relative(entry.path(), root).generic_string();
      const int own = layer_of(path);
      CAPTURE(path);
      REQUIRE(own >= 0);
      ++files;
      std::ifstream stream(entry.path());
      for (std::string line; std::getline(stream, line);) {
        if (!line.starts_with("#include \"")) continue;
        const std::string included = line.substr(10, line.find('"', 10) - 10);
        const int other = layer_of(included);
        CAPTURE(included);
        if (included.find('/') != std::string::npos) REQUIRE(other >= 0);
        CHECK(other <= own);
        if (!family_of(path).empty() && !family_of(included).empty()) CHECK(family_of(path) == family_of(included));
        ++includes;
      }
    }
  CHECK(files > 50);
  CHECK(includes > 100);
}

TEST_CASE("the verdict includes nothing that could simulate") {
  const std::filesystem::path root = WHEELHOP_SOURCE;
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(root / "core/gap/verdict")) {
    std::ifstream stream(entry.path());
    ++files;
    for (std::string line; std::getline(stream, line);) {
      CAPTURE(entry.path().string(), line);
      if (line.starts_with("#include \""))
        CHECK(
            (line.find("\"core/base/") != std::string::npos || line.find("\"core/gap/verdict/") != std::string::npos));
    }
  }
  CHECK(files > 8);
}

TEST_CASE("what makes blind cases shares no laws, simulation or catalogue with the diagnosis it tests") {
  const std::filesystem::path root = WHEELHOP_SOURCE, blind = root / "experiments/blind";
  std::vector<std::filesystem::path> files = {blind / "make.hpp", blind / "make.cpp"};
  for (const auto& entry : std::filesystem::directory_iterator(root / "experiments/rig")) files.push_back(entry.path());
  CHECK(files.size() > 20);
  for (const auto& file : files) {
    CAPTURE(file.string());
    std::ifstream stream(file);
    REQUIRE(stream);
    for (std::string line; std::getline(stream, line);) {
      if (!line.starts_with("#include \"")) continue;
      const std::string included = line.substr(10, line.find('"', 10) - 10);
      CAPTURE(included);
      CHECK((included.starts_with("core/base/") || included.starts_with("core/data/") ||
             included.starts_with("experiments/rig/") || included == "experiments/blind/make.hpp" ||
             included.starts_with("experiments/run/")));
    }
  }
}

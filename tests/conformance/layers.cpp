// The layers of the house: includes point down only.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace {

/// From the bottom up; a folder may include itself and what stands before it.
const std::vector<std::string> kLayers = {"core/base/",     "core/data/", "core/plant/", "core/model/", "core/kernels/",
                                          "core/identify/", "core/gap/",  "variants/",   "experiments/"};

/// Position of a path in kLayers, -1 for none.
int layer_of(const std::string& path) {
  for (std::size_t i = 0; i < kLayers.size(); ++i)
    if (path.starts_with(kLayers[i])) return static_cast<int>(i);
  return -1;
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

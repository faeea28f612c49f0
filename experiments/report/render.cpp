#include "experiments/report/render.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "experiments/run/file_uses.hpp"
#include "experiments/run/home.hpp"

extern char** environ;

namespace wheelhop {

Rendered render(const std::filesystem::path& result, const std::filesystem::path& page) {
  std::vector<std::string> words = {"node", (home() / "plots" / "render.mjs").string(),
                                    std::filesystem::absolute(result).string()};
  if (!page.empty()) {
    words.push_back("--out");
    words.push_back(std::filesystem::absolute(page).string());
  }
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  if (const int error = ::posix_spawnp(&child, "node", nullptr, nullptr, arguments.data(), environ))
    return {127, fmt::format("Node.js (node) could not be started: {}", std::strerror(error))};
  int state = 0;
  while (::waitpid(child, &state, 0) < 0)
    if (errno != EINTR) return {127, fmt::format("lost sight of node: {}", std::strerror(errno))};
  if (WIFSIGNALED(state)) return {128 + WTERMSIG(state), fmt::format("node was ended by signal {}", WTERMSIG(state))};
  const int status = WEXITSTATUS(state);
  return {status, status == 0 ? "" : fmt::format("plots/render.mjs ended with status {}", status)};
}

namespace {

/// The page and what it is drawn from. @param result folder of a reproduction or sweep, or a diagnosis file
FileUses uses_of_report(const std::filesystem::path& result, const std::filesystem::path& page) {
  FileUses uses;
  std::filesystem::path standard = result;
  std::error_code ignored;
  if (std::filesystem::is_directory(result, ignored)) {
    standard /= "report.html";
    for (const char* name : {"table1.json", "table.json", "compare.json", "figures/figures.json"})
      uses.reads("a file of RESULT", result / name);
  } else {
    standard.replace_extension(".html");
    std::filesystem::path figures = result;
    uses.reads_named("RESULT", result)
        .reads("the figures' data beside RESULT", figures.replace_extension(".figures.json"));
  }
  return uses.writes(page.empty() ? "the page of RESULT" : "--out", page.empty() ? standard : page);
}

}  // namespace

int run_report(const ReportRequest& request) {
  uses_of_report(request.result, request.page).check();
  const Rendered drawn = render(request.result, request.page);
  if (drawn.exit_status != 0) std::fprintf(stderr, "wheelhop: report: %s\n", drawn.message.c_str());
  return drawn.exit_status == 0 ? 0 : drawn.exit_status == 2 ? 2 : 1;
}

}  // namespace wheelhop

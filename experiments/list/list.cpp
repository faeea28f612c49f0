#include "experiments/list/list.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "core/identify/pipeline.hpp"
#include "core/plant/laws.hpp"
#include "core/plant/road.hpp"
#include "experiments/experiment/config.hpp"
#include "experiments/generate/config.hpp"
#include "experiments/identify/study.hpp"
#include "experiments/rig/cases.hpp"
#include "experiments/run/standard_output.hpp"
#include "experiments/sweep/grid.hpp"
#include "variants/table.hpp"

namespace wheelhop {
namespace {

Json options_json(const std::vector<OptionInfo>& options) {
  Json out = Json::array();
  for (const OptionInfo& option : options)
    out.push_back({{"name", option.name},
                   {"default", option.fallback},
                   {"unit", option.unit},
                   {"range", option.range},
                   {"meaning", option.meaning}});
  return out;
}

Json piece_json(const PieceInfo& piece) {
  Json out = {{"name", piece.name},
              {"source", piece.source},
              {"meaning", piece.meaning},
              {"available", piece.unavailable.empty()}};
  if (!piece.unavailable.empty()) out["unavailable"] = piece.unavailable;
  out["options"] = options_json(piece.options);
  return out;
}

PieceInfo law_piece(const LawKind& law) {
  PieceInfo piece{law.name, law.source, law.equation, "", {}};
  for (const LawParameter& parameter : law.parameters) {
    Json fallback = "required";
    if (!parameter.required) fallback = std::isfinite(parameter.fallback) ? Json(parameter.fallback) : Json("none");
    piece.options.push_back({parameter.name, std::move(fallback), parameter.unit, to_string(parameter.range),
                             parameter.meaning + (parameter.is_list ? " (a list)" : "")});
  }
  return piece;
}

std::vector<Family> everything() {
  std::vector<Family> all = families();
  Family pipeline{"pipeline", "the algorithm of Sec. 2.7 around the pieces, and the joint refinement", {}};
  pipeline.pieces.push_back({"pipeline", "Sec. 2.7", "steps 1 to 5", "", describe_options<PipelineOptions>()});
  Family experiment{"experiment", "how `reproduce` and `sweep` make their records; members of their config", {}};
  experiment.pieces.push_back({"records", "Sec. 3; the numbers it leaves open are judgements",
                               "beside plant, drive, outputs and plant_parameters", "",
                               describe_options<DataOptions>()});
  experiment.pieces.push_back(
      {"departures", "this benchmark", "from the paper's experiment", "", describe_options<DepartureOptions>()});
  experiment.pieces.push_back(
      {"sweep", "this benchmark", "beside base, axes and exclude", "", describe_options<SweepOptions>()});
  experiment.pieces.push_back({"until", "Ramdas, Grunwald, Vovk & Shafer 2023",
                               "realisations added until claims are decided", "", describe_options<Until>()});
  Family configs{"config", "members of the configs of other commands", {}};
  configs.pieces.push_back(
      {"generate", "this benchmark", "beside plant, hold_hz and records", "", describe_options<GenerateOptions>()});
  configs.pieces.push_back(
      {"generate: records", "this benchmark", "of each group, beside drive", "", describe_options<GroupOptions>()});
  configs.pieces.push_back({"identify", "this benchmark",
                            "beside plant or inputs and outputs, record, pieces and pipeline", "",
                            describe_options<IdentifyOptions>()});
  configs.pieces.push_back({"identify: linear", "this benchmark",
                            "search for delays, time scales and order in place of a piece under subspace", "",
                            describe_options<LinearSearchOptions>()});
  configs.pieces.push_back(
      {"blind make", "this benchmark", "beside sets", "", describe_options<blind::CasesOptions>()});
  configs.pieces.push_back({"blind make: sets", "this benchmark", "of each, beside plant and effects", "",
                            describe_options<blind::SetOptions>()});
  Family laws{"law", "force of an element in a plant file", {}};
  for (const LawKind& law : law_table()) laws.pieces.push_back(law_piece(law));
  Family drives{"drive", "what moves an input in generate and reproduce", {}};
  for (const DriveEntry& entry : drive_table())
    drives.pieces.push_back({entry.name, entry.source, "", "", entry.options});
  all.push_back(std::move(pipeline));
  all.push_back(std::move(experiment));
  all.push_back(std::move(configs));
  all.push_back(std::move(laws));
  all.push_back(std::move(drives));
  return all;
}

void print_piece(const PieceInfo& piece) {
  fmt::print("\n  {}{}\n", piece.name, piece.unavailable.empty() ? "" : "   (unavailable: " + piece.unavailable + ")");
  if (!piece.meaning.empty()) fmt::print("    {}\n", piece.meaning);
  if (!piece.source.empty()) fmt::print("    source: {}\n", piece.source);
  for (const OptionInfo& option : piece.options) {
    const std::string unit = option.unit.empty() || option.unit == "-" ? "" : " " + option.unit;
    const std::string fallback = option.fallback == "required" ? "required" : "default " + option.fallback.dump();
    fmt::print("    - {}: {}{}; {}\n        {}\n", option.name, fallback, unit, option.range, option.meaning);
  }
}

}  // namespace

Json list_pieces() {
  Json out = {{"schema", "wheelhop.list/1"}, {"families", Json::array()}};
  for (const Family& family : everything()) {
    Json pieces = Json::array();
    for (const PieceInfo& piece : family.pieces) pieces.push_back(piece_json(piece));
    out["families"].push_back({{"family", family.name}, {"meaning", family.meaning}, {"pieces", std::move(pieces)}});
  }
  return out;
}

int run_list(const ListRequest& request) {
  require_standard_output();
  if (request.json) {
    fmt::print("{}\n", list_pieces().dump(2));
    return 0;
  }
  bool first = true;
  for (const Family& family : everything()) {
    fmt::print("{}{}: {}\n", first ? "" : "\n", family.name, family.meaning);
    for (const PieceInfo& piece : family.pieces) print_piece(piece);
    first = false;
  }
  return 0;
}

}  // namespace wheelhop

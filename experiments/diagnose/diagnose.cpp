#include "experiments/diagnose/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "core/base/files.hpp"
#include "core/data/slow_channels.hpp"
#include "core/data/spikes.hpp"
#include "core/greybox/pieces.hpp"
#include "core/greybox/plant_fit.hpp"
#include "experiments/diagnose/json.hpp"
#include "experiments/diagnose/report.hpp"
#include "experiments/diagnose/view.hpp"
#include "experiments/report/render.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/input_checks.hpp"
#include "experiments/run/jobs.hpp"
#include "experiments/run/provenance.hpp"
#include "variants/nonlinearity/mlp.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/solver/secant_levenberg_marquardt.hpp"
#include "variants/table.hpp"

namespace wheelhop {
namespace {

constexpr std::uint64_t kBootstrapSeed = 1, kPlaceboSeed = 3;

/// The plant in which the answer is missing: its parameters those found together with the effects, which do not bend to
/// make up for them as re-tuned ones do; the plant as delivered where a parameter is the answer, or nothing.
Plant bare_plant(const Plant& plant, const Diagnosis& diagnosis) {
  if (is_place(diagnosis.verdict) || is<Insufficient>(diagnosis.verdict)) return diagnosis.retuned_plant;
  Plant bare = plant;
  const bool parameter = is<Parameters>(diagnosis.verdict) && diagnosis.evidence.correction.faults.empty() &&
                         is_parameter_error(diagnosis.verdict.suspects.front().effect);
  if (parameter || is<NoGap>(diagnosis.verdict)) return bare;
  for (const FitParameter& moved : tolerance_parameters(plant))
    set_parameter(bare, moved.name, get_parameter(diagnosis.plant, moved.name));
  return bare;
}

/// What an earlier run left under the names of this one. First the diagnosis itself, which names its plant; figures and
/// page of another diagnosis would lie.
void withdraw_earlier(const DiagnoseRequest& request) {
  withdraw(request.out);
  if (request.report.empty()) return;
  withdraw(figures_beside(request.out));
  withdraw(request.report);
}

/// A diagnosis does not fail for want of a picture.
void draw(const Plant& plant, const Examination& examination, const DiagnoseRequest& request) {
  const std::filesystem::path figures = figures_beside(request.out);
  write_json(figures, diagnosis_figures_json(plant, examination));
  std::fflush(stdout);
  const Rendered drawn = render(request.out, request.report);
  if (drawn.exit_status == 0)
    fmt::print("drawn: {}\n", request.report.string());
  else
    fmt::print("not drawn: {} ({}); its data: {}\n", request.report.string(), drawn.message, figures.string());
}

}  // namespace

CandidateList catalogue_without(std::vector<std::string> left_out) {
  return [left_out = std::move(left_out)](const Plant& plant, const Operation& operation) {
    std::vector<EffectCandidate> candidates = effect_candidates(plant, operation);
    const auto is_out = [&](const Label& label) {
      return std::find(left_out.begin(), left_out.end(), label.effect.text()) != left_out.end();
    };
    std::erase_if(candidates, [&](const EffectCandidate& candidate) { return is_out(candidate.label()); });
    for (EffectCandidate& candidate : candidates) std::erase_if(candidate.labels, is_out);
    return candidates;
  };
}

Diagnosis diagnose_records(const Plant& plant, const RecordSet& set, const CandidateList& candidates,
                           const std::function<void(const std::string&)>& step) {
  const auto quick =
      make_secant_levenberg_marquardt({.relative_decrease = kQuickDecrease, .trusted_gain = 0.25, .ending_share = 1});
  const auto thorough = make_secant_levenberg_marquardt({.relative_decrease = 1e-4});
  const auto patient = make_levenberg_marquardt({.relative_decrease = 1e-5});
  return diagnose(plant, set, candidates, {*quick, *thorough, *patient}, {}, kBootstrapSeed, step);
}

std::filesystem::path corrected_beside(std::filesystem::path diagnosis) {
  return diagnosis.replace_extension(".plant.json");
}

std::filesystem::path write_diagnosis(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination,
                                      const View& view, const std::filesystem::path& out, const Json& more) {
  const std::filesystem::path corrected = corrected_beside(out);
  write_json(corrected, to_json(diagnosis.plant));
  Json file = diagnosis_json(plant, diagnosis, examination, view, corrected.filename().string());
  file.update(more);
  write_json(out, file);
  return corrected;
}

int run_diagnose(const DiagnoseRequest& request) {
  FileUses uses;
  uses.reads_named("--plant", request.plant)
      .reads_named("--records", request.records)
      .writes("--out", request.out)
      .writes("the corrected plant beside --out", corrected_beside(request.out));
  if (!request.report.empty())
    uses.writes("--report", request.report).writes("the figures' data beside --out", figures_beside(request.out));
  uses.check();
  Plant plant = load_plant_of_records(request.plant);
  RecordSet set = load_records(request.records, plant.input_channels(), plant.output_channels());
  add_silent_drive(plant, set);
  require_sound_records(set, request.records);
  bridge_spikes(set);
  find_slow_channels(set);
  require_held_out(set, request.records);
  plant = with_drive_rate(std::move(plant), set);
  require_hold_rate(plant, set, request.records);
  Json origin = {{"provenance", provenance(set)}};
  const auto step = [&](const std::string& what) {
    if (!request.quiet) std::fprintf(stderr, "diagnose: %s\n", what.c_str());
  };
  const Index piece = piece_samples(plant, set);
  const std::string pieces =
      piece > 0 ? fmt::format(
                      "compared in pieces of about {:.3g} s, each from its own initial state: nothing holds "
                      "some mass of the plant, so that over a whole record every error would add up",
                      static_cast<double>(piece) / set.sampling_hz)
                : "";
  if (piece > 0) {
    step(pieces);
    origin["pieces"] = pieces;
    set = in_pieces(std::move(set), piece);
  }
  const Diagnosis diagnosis =
      at_records(set, request.records, [&] { return diagnose_records(plant, set, effect_candidates, step); });
  if (diagnosis.status != Status::ok) {
    withdraw_earlier(request);
    write_diagnosis(plant, diagnosis, nullptr, {}, request.out, origin);
    std::fprintf(stderr, "wheelhop: %s\n", diagnosis.verdict.message.c_str());
    return 1;
  }
  step("where the gap lies");
  Random bootstrap(2, Stream::bootstrap);
  const auto solver = make_secant_levenberg_marquardt({.relative_decrease = 1e-4});
  const std::unique_ptr<StaticMap> map = make_mlp(2, 1, {});
  const auto map_solver = make_levenberg_marquardt({});
  const Examination examination =
      examine({plant, diagnosis.retuned_plant, diagnosis.plant}, set, diagnosis.floor, bare_plant(plant, diagnosis),
              place_of_note(diagnosis), *solver,
              {.ceiling = place_of_ceiling(diagnosis), .map = map.get(), .map_solver = map_solver.get()}, bootstrap);
  withdraw_earlier(request);
  View view = view_of(plant, diagnosis, &examination, nullptr);
  const std::filesystem::path corrected = write_diagnosis(plant, diagnosis, &examination, view, request.out, origin);
  Placebo again;
  if (request.placebo > 0) {
    const JobOptions jobs{0, "placebo", fmt::format("the diagnosis without its placebo is in {}", request.out.string()),
                          request.quiet};
    again = placebo(
        diagnosis, set, request.placebo, kPlaceboSeed,
        [&](const RecordSet& simulated) { return diagnose_records(plant, simulated, effect_candidates); },
        [&](Index count, const std::function<void(Index)>& work) {
          run_jobs(static_cast<std::size_t>(count), jobs, [&](std::size_t i) -> std::function<void()> {
            work(static_cast<Index>(i));
            return {};
          });
        });
    Json more = origin;
    more["placebo"] = placebo_json(again);
    view = view_of(plant, diagnosis, &examination, &again);
    write_diagnosis(plant, diagnosis, &examination, view, request.out, more);
  }
  if (piece > 0) fmt::print("{}\n", pieces);
  print(view);
  fmt::print("\nwritten: {}, {}\n", request.out.string(), corrected.string());
  if (!request.report.empty()) draw(plant, examination, request);
  return 0;
}

}  // namespace wheelhop

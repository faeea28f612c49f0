#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "experiments/reproduce/table.hpp"
#include "experiments/run/provenance.hpp"

namespace wheelhop {
namespace {

Json statistics_json(const Statistics& s) {
  return {{"median", s.median}, {"q05", s.q05}, {"q95", s.q95}, {"min", s.min}, {"n_ok", s.n_ok}, {"n", s.n}};
}

double mass_ratio(const ReproduceConfig& config) {
  const auto mass = [&](Index i) { return config.plant.masses[static_cast<std::size_t>(i)].mass_kg; };
  return -mass(config.car->wheel) / mass(config.car->body);
}

Json by_signal(const std::array<double, 3>& values) {
  Json out = Json::object();
  for (std::size_t s = 0; s < 3; ++s) out[kPaperSignals[s].name] = values[s];
  return out;
}

Json row_json(const ReproduceConfig& config, const RealisationRow& row) {
  Json out = {{"realisation", row.realisation},
              {"status", std::string(to_string(row.status))},
              {"message", row.message},
              {"order", row.order},
              {"gap", row.gap},
              {"direction_residual", row.direction_residual},
              {"agreeing_starts", row.agreeing_starts},
              {"passes", Json::array()},
              {"best_pass", row.best_pass + 1}};
  for (const Pass& pass : row.passes)
    out["passes"].push_back(
        {{"status", std::string(to_string(pass.status))},
         {"message", pass.message},
         {"map_residual", pass.map_residual},
         {"training_vaf_percent", std::vector<double>(pass.training_vaf.begin(), pass.training_vaf.end())}});
  out["refinement"] = to_json(row.refinement);
  for (std::size_t c = 0; c < kColumns; ++c) {
    const ColumnScore& column = row.columns[c];
    Json entry = {{"status", std::string(to_string(column.status))},
                  {"message", column.message},
                  {"vaf_percent", by_signal(column.vaf_percent)}};
    if (config.data.snr_db) entry["residual_over_noise"] = by_signal(column.residual_over_noise);
    out["models"][kColumnNames[c]] = std::move(entry);
  }
  out["physics"] = {{"direct_term_ratio", row.direct_ratio}, {"spring_r2", row.spring_r2}};
  return out;
}

}  // namespace

Statistics column_statistics(const std::vector<RealisationRow>& rows, std::size_t column, std::size_t signal) {
  std::vector<double> values;
  for (const RealisationRow& row : rows) values.push_back(row.columns[column].vaf_percent[signal]);
  return statistics_of(std::move(values));
}

Statistics noise_statistics(const std::vector<RealisationRow>& rows, std::size_t column, std::size_t signal) {
  std::vector<double> values;  // negated: a large ratio is bad, and a failed one is the worst
  for (const RealisationRow& row : rows) values.push_back(-row.columns[column].residual_over_noise[signal]);
  Statistics s = statistics_of(std::move(values));
  return {-s.median, -s.q05, -s.q95, -s.min, s.n_ok, s.n};
}

Json notes(const ReproduceConfig& config) {
  Json list = Json::array();
  const auto note = [&](const char* what, std::string chosen, const char* why) {
    list.push_back(
        {{"what", what}, {"chosen", std::move(chosen)}, {"why", config.preset ? why : "as the config says"}});
  };
  std::string parameters;
  for (const PlantParameter& parameter : plant_parameters(config.plant))
    parameters += fmt::format("{}{} = {:g}", parameters.empty() ? "" : ", ", parameter.name, parameter.value);
  note("Parameters of the car", parameters,
       "a passenger car's corner whose linear model scores what the paper's does; none is printed in the paper");
  const Json drive = to_json(config.drive);
  std::string amplitude;
  for (const auto& [key, value] : drive.items())
    amplitude += fmt::format("{}{}: {}", amplitude.empty() ? "" : ", ", key,
                             value.is_string() ? value.get<std::string>() : value.dump());
  note("Amplitude and filter of the road", amplitude,
       "drives the spring out of its linear range as often as the paper's linear scores tell; the paper says "
       "band-limited, 10 Hz, held at 1000 Hz");
  note("Length of the records",
       fmt::format("{:g} s training, {:g} s validation, after {:g} s to settle", config.data.estimation_s,
                   config.data.validation_s, config.data.settle_s),
       "long enough for a body mode of 1.5 Hz; below 40 s the subspace estimate loses points");
  note("Measurement noise",
       config.data.snr_db ? fmt::format("white, {:g} dB below each output", *config.data.snr_db) : "none",
       "the paper mentions none; scores are against outputs without noise in either case");
  note("Number of realisations", fmt::format("{}", config.data.realisations),
       "the paper prints one; scores move by several points from one to the next");
  note("Random numbers",
       fmt::format("master seed {}, counter-based streams for road, noise and initial guess", config.data.seed),
       "every realisation can be made again alone, in any order");
  note("Initial state of a validation run",
       fmt::format("least squares on the first {} samples", config.data.initial_state_samples),
       "a free run needs one; the paper does not say which");
  note("Resampling to the measuring rate",
       fmt::format("every {:g}th sample, no filter", config.plant.hold_hz() / config.data.sampling_hz),
       "outputs hold 4e-11 of their power above half the measuring rate, and a filter smears static laws");
  note(
      "Model order",
      config.pipeline.order > 0 ? fmt::format("{}", config.pipeline.order) : "read from the gap of the singular values",
      "two masses have four states; the paper gives only the bound s");
  return list;
}

Json table1_json(const ReproduceConfig& config, const std::vector<RealisationRow>& rows) {
  Json out = {{"schema", "wheelhop.table1/1"}, {"realisations", config.data.realisations}, {"rows", Json::array()}};
  for (std::size_t s = 0; s < 3; ++s) {
    const PaperSignal& paper = kPaperSignals[s];
    Json line = {{"signal", paper.name},
                 {"unit", config.plant.sensors[static_cast<std::size_t>(config.car->sensors[s])].unit},
                 {"paper", {{"linear", paper.linear_vaf}, {"nonlinear", paper.nonlinear_vaf}}}};
    for (std::size_t c = 0; c < kColumns; ++c)
      line["vaf_percent"][kColumnNames[c]] = statistics_json(column_statistics(rows, c, s));
    if (config.data.snr_db)
      for (std::size_t c = 0; c < kColumns; ++c) {
        const Statistics ratio = noise_statistics(rows, c, s);
        line["residual_over_noise"][kColumnNames[c]] = {
            {"median", ratio.median}, {"worst", ratio.min}, {"n_ok", ratio.n_ok}, {"n", ratio.n}};
      }
    out["rows"].push_back(std::move(line));
  }
  std::vector<double> ratios, fits;
  for (const RealisationRow& row : rows) {
    ratios.push_back(row.direct_ratio);
    fits.push_back(row.spring_r2);
  }
  Statistics ratio = statistics_of(ratios);
  out["physics"] = {{"direct_term_ratio", statistics_json(ratio)},
                    {"expected_direct_term_ratio", mass_ratio(config)},
                    {"spring_r2", statistics_json(statistics_of(fits))}};
  out["beyond_training"] = Json::array();
  for (const RealisationRow& row : rows)
    if (row.beyond.samples > 0) {
      Json refined = by_signal(row.columns[static_cast<std::size_t>(Column::refined)].vaf_percent);
      out["beyond_training"].push_back({{"realisation", row.realisation},
                                        {"samples", row.beyond.samples},
                                        {"share_of_training_range", by_signal(row.beyond.share_of_range)},
                                        {"refined_vaf_percent", std::move(refined)}});
    }
  out["notes"] = notes(config);
  out["per_realisation"] = Json::array();
  for (const RealisationRow& row : rows) out["per_realisation"].push_back(row_json(config, row));
  out["config"] = config.effective;
  out["provenance"] = provenance();
  return out;
}

}  // namespace wheelhop

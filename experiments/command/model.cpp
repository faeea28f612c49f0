// list, look, generate, identify, simulate: from pieces and records to a model and its free run.
#include "experiments/command/command.hpp"
#include "experiments/generate/generate.hpp"
#include "experiments/identify/identify.hpp"
#include "experiments/list/list.hpp"
#include "experiments/look/look.hpp"
#include "experiments/simulate/simulate.hpp"

namespace wheelhop {

void add_list(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "list", "every piece, effect, law and drive: source, options, defaults, units", run, run_list);
  command.add_flag("--json", request.json, "as JSON");
  command.footer("Example:\n  wheelhop list --json");
}

void add_look(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "look", "what a logger's file holds, and the records.json that reads it", run, run_look);
  command.add_option("FILE", request.file, "text (.csv, .txt, .tsv, .dat, .asc, or one of these and .gz) or .mat")
      ->required();
  command.add_option("--out", request.out, "records.json to write");
  command.add_option("--rate", request.rate_hz, "rate in Hz, where no column tells the time or its unit is not told")
      ->check(CLI::Range(1e-9, 1e12));
  command.add_option("--layout", request.layout, "what cannot be found of the layout, as JSON: members of \"format\"");
  command.footer(
      "Prints how the file is written, its rate, lost samples, and a line a column: unit, range, resolution, cells "
      "without\n"
      "a number, spikes, samples at the end of the range, and the frequency below which its power lies; then the\n"
      "records.json that reads it. There a set, or one of its records, may say\n"
      "  \"columns\": {\"acc\": \"Accel Z [g]\", \"road\": {\"column\": 3, \"unit\": \"V\", \"sensitivity\": \"20 "
      "V/m\"}}\n"
      "  \"time\": \"Time\", {\"column\": \"Time\", \"unit\": \"ms\"} or {\"rate_hz\": 200}\n"
      "  \"format\": {\"separator\": \";\", \"decimal\": \",\", \"header_row\": 5, \"unit_row\": 6, \"first_row\": 7}\n"
      "  \"lost_samples\": \"bridge\" or \"cut\"\n"
      "and the set \"resample_hz\": 200. What it does not say is found, or refused with what to say.\n"
      "Example:\n  wheelhop look logger.csv --layout '{\"decimal\": \",\"}' --out records.json");
}

void add_generate(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "generate", "simulate a data set: records, plant, provenance", run, run_generate);
  command.add_option("CONFIG", request.config, "plant, drives and records as JSON")->required();
  command.add_option("--out", request.out, "folder to write")->required();
  add_quiet(command, request.quiet);
  command.footer(
      "CONFIG names a plant file, a rate, and a drive for each record (see wheelhop list):\n"
      "  {\"plant\": \"plant.json\", \"sampling_hz\": 200, \"noise_snr_db\": 40, \"records\": [\n"
      "    {\"role\": \"estimation\", \"duration_s\": 60, \"repeats\": 2, \"drive\": {\"name\": \"multisine\", "
      "\"rms\": 0.008}},\n"
      "    {\"role\": \"validation\", \"duration_s\": 60, \"drive\": {\"name\": \"iso8608\",\n"
      "     \"to_cycles_per_m\": 2}}]}\n"
      "Example:\n  wheelhop generate experiments/configs/generate_quarter_car.json --out out/quarter_car");
}

void add_identify(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "identify", "a nonlinear state-space model of a record, with its scores", run, run_identify);
  command.add_option("CONFIG", request.config, "channels, pieces and options as JSON")->required();
  command.add_option("--records", request.records, "records.json with an estimation record")->required();
  command.add_option("--out", request.out, "model file to write")->required();
  add_quiet(command, request.quiet);
  command.footer(
      "CONFIG names the channels, everything else has a default that fits itself to the record (see wheelhop list):\n"
      "  {\"inputs\": [{\"name\": \"road\", \"unit\": \"m\"}],\n"
      "   \"outputs\": [{\"name\": \"travel\", \"unit\": \"m\"}, {\"name\": \"body_acc\", \"unit\": \"m/s^2\"}],\n"
      "   \"nonlinearity\": {\"name\": \"mlp\", \"hidden_units\": 5}, \"pipeline\": {\"passes\": 3}}\n"
      "or takes them from a plant: {\"plant\": \"plant.json\"}.\n"
      "All records of role estimation are fitted, or the one that \"record\" names. Delays, time scales and order are\n"
      "found, within \"linear\": {\"max_order\": 20, \"max_delay\": 20}; \"order\": 4 fixes the order, and a piece "
      "under\n"
      "\"subspace\" takes the place of this search. The linear model, the best pass and the refined model are compared "
      "on\n"
      "the last quarter of every record, and the best is delivered: scores.delivered in the model file says which and "
      "why.\n"
      "\"pipeline\": {\"nonlinearities\": 0} asks for the linear model alone.\n"
      "Example:\n  wheelhop identify experiments/configs/identify_quarter_car.json --records "
      "out/quarter_car/records.json --out out/model.json");
}

void add_simulate(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "simulate", "free run of a model or plant on the inputs of records", run, run_simulate);
  command.add_option("SYSTEM", request.system, "model file or plant file")->required();
  command.add_option("--records", request.records, "records.json; only the inputs are needed")->required();
  command.add_option("--out", request.out, "table to write: .csv, .csv.gz or .mat")->required();
  command.add_option("--x0", request.x0, "initial state of a model; auto: estimate where outputs are there")
      ->check(CLI::IsMember({"auto", "estimate", "zero"}))
      ->capture_default_str();
  add_quiet(command, request.quiet);
  command.footer(
      "Columns: record (number, only where there are several), t, the inputs, the simulated outputs.\n"
      "Example:\n  wheelhop simulate out/model.json --records out/quarter_car/records.json --out out/simulated.csv");
}

}  // namespace wheelhop

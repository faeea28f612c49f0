#include "experiments/simulate/simulate.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "core/data/records.hpp"
#include "core/data/table.hpp"
#include "core/greybox/plant_fit.hpp"
#include "core/model/model_file.hpp"
#include "core/plant/dataset.hpp"
#include "experiments/identify/study.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/input_checks.hpp"
#include "variants/table.hpp"

namespace wheelhop {
namespace {

/// Either of the two kinds of system.
struct System {
  std::optional<ModelFile> model;
  Plant plant;
  std::vector<Channel> inputs, outputs;
};

System load_system(const std::filesystem::path& file) {
  System system;
  const JsonCursor cursor = JsonCursor::load(file);
  if (!cursor.is_object() || !cursor.raw().contains("schema")) {
    system.plant = require_acting_inputs(parse_plant(cursor), cursor.where());
    system.inputs = system.plant.input_channels();
    system.outputs = system.plant.output_channels();
    return system;
  }
  system.model = parse_model(cursor, restore_map);
  system.inputs = system.model->inputs;
  system.outputs = system.model->outputs;
  return system;
}

struct Run {
  Status status = Status::ok;
  std::string message;
  Matrix y;
};

Run run_model(const ModelFile& model, const Record& record, bool estimate, bool quiet) {
  const Signal& signal = record.signal;
  constexpr Index samples = 0;  // as many as the identification takes
  const FreeRun run =
      free_run(model, signal.u, estimate ? initial_state(model, signal, samples) : Vector::Zero(model.model.order()));
  if (run.status != Status::ok)
    return {run.status,
            fmt::format("the free run diverged at {:g} s", static_cast<double>(run.stopped_at) * signal.sample_time_s),
            {}};
  if (!quiet)
    for (const Excess& excess : beyond_envelope(model, signal.u, run.y, run.f))
      std::fprintf(stderr, "%s: %s leaves the training range by %.3g%s%s (%.1f %% of it) in %td of %td samples\n",
                   record.file.c_str(), excess.channel.c_str(), excess.distance, excess.unit.empty() ? "" : " ",
                   excess.unit.c_str(), 100 * excess.share, excess.samples, signal.samples());
  return {Status::ok, "", run.y};
}

Run run_plant(const Plant& plant, const Record& record) {
  GeneratedRecord run =
      simulate_record(plant, record.signal, {.substeps = stable_substeps(plant), .from_equilibrium = true});
  return {run.status, run.message, std::move(run.signal.y)};
}

/// Records with the outputs where they are wanted and there; `estimate` tells whether they are.
RecordSet load_set(const SimulateRequest& request, const System& system, bool& estimate) {
  estimate = system.model && request.x0 != "zero";
  if (!estimate) return load_records(request.records, system.inputs, {});
  if (request.x0 == "estimate") return load_records(request.records, system.inputs, system.outputs);
  try {
    return load_records(request.records, system.inputs, system.outputs);
  } catch (const MachineError&) {
    throw;
  } catch (const UserError& error) {
    RecordSet set = load_records(request.records, system.inputs, {});
    if (!request.quiet) std::fprintf(stderr, "starting from the zero state, outputs are not read: %s\n", error.what());
    estimate = false;
    return set;
  }
}

}  // namespace

int run_simulate(const SimulateRequest& request) {
  FileUses()
      .reads_named("SYSTEM", request.system)
      .reads_named("--records", request.records)
      .writes("--out", request.out)
      .check();
  require_table_name(request.out);
  System system = load_system(request.system);
  bool estimate = false;
  const RecordSet set = load_set(request, system, estimate);
  require_sound_records(set, request.records);
  if (!system.model) system.plant = with_drive_rate(std::move(system.plant), set);
  if (!system.model) require_hold_rate(system.plant, set, request.records);
  if (system.model && std::abs(system.model->sampling_hz / set.sampling_hz - 1) > 1e-9)
    throw UserError(fmt::format("{}: $.sampling_hz: expected {} as in {}, found {}", request.records.string(),
                                system.model->sampling_hz, request.system.string(), set.sampling_hz));
  const bool several = set.records.size() > 1;
  Table table;
  if (several) table.names.push_back("record");
  table.names.push_back("t");
  for (const Channel& channel : system.inputs) table.names.push_back(channel.name);
  for (const Channel& channel : system.outputs) table.names.push_back(channel.name);
  Index total = 0, filled = 0;
  for (const Record& record : set.records) total += record.signal.samples();
  table.columns.resize(static_cast<Index>(table.names.size()), total);
  for (std::size_t r = 0; r < set.records.size(); ++r) {
    const Record& record = set.records[r];
    const Run run =
        system.model ? run_model(*system.model, record, estimate, request.quiet) : run_plant(system.plant, record);
    if (run.status != Status::ok) {
      const double radius = system.model ? spectral_radius(system.model->model.linear.A) : 0;
      if (radius >= 1)
        throw UserError(fmt::format("{}: $.A: expected a stable model, found a spectral radius of {:.6g}, and on {} {}",
                                    request.system.string(), radius, record.file, run.message));
      std::fprintf(stderr, "%s: %s: %s; nothing is written\n", record.file.c_str(),
                   std::string(to_string(run.status)).c_str(), run.message.c_str());
      return 1;
    }
    const Index count = record.signal.samples();
    auto block = table.columns.middleCols(filled, count);
    if (several) block.row(0).setConstant(static_cast<double>(r));
    for (Index k = 0; k < count; ++k) block(several ? 1 : 0, k) = static_cast<double>(k) / set.sampling_hz;
    block.middleRows(several ? 2 : 1, record.signal.u.rows()) = record.signal.u;
    block.bottomRows(run.y.rows()) = run.y;
    filled += count;
  }
  write_table(request.out, table);
  return 0;
}

}  // namespace wheelhop

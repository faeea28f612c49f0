// diagnose, decide, plan: where a simulation and its rig disagree.
#include "experiments/command/command.hpp"
#include "experiments/decide/decide.hpp"
#include "experiments/diagnose/diagnose.hpp"
#include "experiments/plan/plan.hpp"

namespace wheelhop {

void add_diagnose(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "diagnose", "why a plant and its records disagree: which effect, how far", run, run_diagnose);
  command.add_option("--plant", request.plant, "plant file with tolerances")->required();
  command.add_option("--records", request.records, "records.json: estimation (best with repeats) and validation")
      ->required();
  command.add_option("--out", request.out, "diagnosis to write; the corrected plant stands beside it")->required();
  command.add_option("--report", request.report, "page with pictures to write (needs Node.js)");
  command
      .add_option("--placebo", request.placebo,
                  "diagnose so many simulations of the answer too: does it come back? (one run takes as long as this)")
      ->check(CLI::Range(1, 10000));
  add_quiet(command, request.quiet);
  command.footer(
      "Re-tunes the plant inside its tolerances, tries every effect of `wheelhop list` at every place where it makes\n"
      "sense, and scores on the validation records. Repeats of one drive give the noise floor: records with the same\n"
      "`repeat_of`, or without any such name those whose drives differ by less than 15 %. A free decay needs no "
      "drive.\n"
      "A plant file gives a mass or law its tolerance, the relative standard deviation within which its values are\n"
      "known (absent: 0.05). Probabilities compare the effects that were fitted; how well they come true was seen on\n"
      "generated cases only (wheelhop blind --help).\n"
      "--placebo 20 asks how far to trust a name with this drive and this noise: records are simulated from the plant\n"
      "with the answer, noise of the measured size and colour added, and diagnosed from the plant as delivered. The\n"
      "row printed below the verdict says how often each name comes back (for no gap: how often one is a false "
      "alarm).\n"
      "It takes as long as 20 diagnoses, and says nothing of causes outside the catalogue: those cannot be simulated.\n"
      "Example:\n  wheelhop diagnose --plant experiments/configs/paper_plant.json --records out/rig/records.json "
      "--out out/rig.json --report out/rig.html");
}

void add_decide(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "decide", "the verdict of a diagnosis again, from its stored evidence", run, run_decide);
  command.add_option("D.json", request.diagnosis, "diagnosis that `wheelhop diagnose` wrote, or its evidence alone")
      ->required();
  command.add_option("--set", request.settings, "NAME=VALUE of a threshold, as the file lists them; may be repeated");
  command.footer(
      "Reads the evidence (fits, leftovers by place, rivals) and applies the decision table and its thresholds, which\n"
      "takes milliseconds. `decided_by` names the row of the table (core/gap/verdict/decide.hpp) that gave the "
      "answer.\n"
      "Example:\n  wheelhop decide out/rig.json --set notice=80");
}

void add_plan(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "plan", "before a test: which effects its drive shows, which it confuses", run, run_plan);
  command.add_option("--plant", request.plant, "plant file with tolerances")->required();
  command.add_option("--records", request.records, "records.json of the planned drives; only the inputs are needed")
      ->required();
  command.add_option("--out", request.out, "plan to write as JSON");
  add_quiet(command, request.quiet);
  command.footer(
      "Simulates every effect of `wheelhop list` at typical size and takes away what parameters could do inside their\n"
      "tolerances. An effect shows if at least one noise level (RMS) is left of it; two effects whose remains have a\n"
      "|cosine| above 0.85 cannot be told apart. Then the same for a menu: level, band, a slow triangle, ride height,\n"
      "repeats, one more sensor. The noise is noise_std of the records, else 1 % of each simulated output.\n"
      "Example:\n  wheelhop plan --plant experiments/configs/paper_plant.json --records out/rig/records.json");
}

}  // namespace wheelhop

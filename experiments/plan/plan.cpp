#include "experiments/plan/plan.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "core/base/files.hpp"
#include "core/gap/evidence/noise_floor.hpp"
#include "core/greybox/plant_fit.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/input_checks.hpp"
#include "experiments/run/provenance.hpp"
#include "experiments/run/standard_output.hpp"
#include "variants/table.hpp"

namespace wheelhop {
namespace {

struct Planned {
  std::vector<FitRecord> records;
  Index repeats = 1;  // the fewest of any drive
};

/// The drives that a diagnosis would fit, each once.
Planned drives_of(const Plant& plant, const RecordSet& set) {
  Planned planned;
  const bool any = !set.with_role("estimation").empty();
  for (const Measured& measured : merge_repeats(set)) {
    if (any && measured.role != "estimation") continue;
    planned.repeats = planned.records.empty() ? measured.repeats : std::min(planned.repeats, measured.repeats);
    planned.records.push_back(fit_record(plant, measured.signal, Vector::Ones(plant.sensor_count())));
    planned.records.back().weight_std /= std::sqrt(static_cast<double>(measured.repeats));
  }
  return planned;
}

const char* verdict(double size_sigma) {
  if (!std::isfinite(size_sigma)) return "not_simulated";
  return size_sigma >= visible_sigma ? "visible" : size_sigma >= marginal_sigma ? "marginal" : "invisible";
}

Json size_json(double size_sigma) { return std::isfinite(size_sigma) ? Json(size_sigma) : Json(); }

Json effect_json(const Plan& plan, std::size_t index) {
  const PlannedEffect& own = plan.planned.effects[index];
  Json confusable = Json::array(), separated = Json::array(), shown = Json::array();
  for (const PlanPair& pair : plan.pairs) {
    if (pair.a != index && pair.b != index) continue;
    const PlannedEffect& other = plan.planned.effects[pair.a == index ? pair.b : pair.a];
    confusable.push_back({{"effect", other.effect},
                          {"location", other.location},
                          {"cosine", pair.cosine},
                          {"left_sigma", pair.left_sigma},
                          {"verdict", std::abs(pair.cosine) > confused_cosine ? "cannot_be_told_apart" : "hard"}});
    if (pair.item >= 0)
      separated.push_back({{"effect", other.effect},
                           {"location", other.location},
                           {"test", plan.menu[static_cast<std::size_t>(pair.item)].view.name},
                           {"cosine", pair.item_cosine},
                           {"verdict", std::abs(pair.item_cosine) > hard_cosine ? "better" : "separated"}});
  }
  for (const PlanItem& item : plan.menu)
    for (const std::size_t effect : item.shows)
      if (effect == index)
        shown.push_back({{"test", item.view.name}, {"size_sigma", item.view.effects[index].size_sigma}});
  return {{"effect", own.effect},
          {"location", own.location},
          {"form", own.form},
          {"size_sigma", size_json(own.size_sigma)},
          {"visible", own.size_sigma >= visible_sigma},
          {"verdict", verdict(own.size_sigma)},
          {"confusable_with", confusable},
          {"separated_by", separated},
          {"shown_by", shown}};
}

Json menu_json(const Plan& plan, const PlanItem& item) {
  const auto names = [&](const std::vector<std::size_t>& effects) {
    Json list = Json::array();
    for (const std::size_t i : effects)
      list.push_back(EffectAt{plan.planned.effects[i].effect, plan.planned.effects[i].location});
    return list;
  };
  Json separates = Json::array(), sizes = Json::object();
  for (const std::size_t p : item.separates) separates.push_back(names({plan.pairs[p].a, plan.pairs[p].b}));
  for (const PlannedEffect& effect : item.view.effects)
    sizes[to_string(EffectAt{effect.effect, effect.location})] = size_json(effect.size_sigma);
  return {{"test", item.view.name},       {"possible", item.view.message.empty()},
          {"message", item.view.message}, {"shows", names(item.shows)},
          {"hides", names(item.hides)},   {"separates", separates},
          {"size_sigma", sizes}};
}

Json to_json(const Plant& plant, const RecordSet& set, const Plan& plan, const Vector& noise,
             const std::vector<std::string>& assumed) {
  Json effects = Json::array(), parameters = Json::array(), pairs = Json::array(), menu = Json::array(),
       std = Json::object();
  for (Index i = 0; i < noise.size(); ++i) std[plant.sensors[static_cast<std::size_t>(i)].name] = noise(i);
  for (std::size_t i = 0; i < plan.planned.effects.size(); ++i) effects.push_back(effect_json(plan, i));
  for (std::size_t i = 0; i < plan.parameters.size(); ++i)
    parameters.push_back(
        {{"name", plan.parameters[i]}, {"std_tolerances", plan.planned.parameter_std(static_cast<Index>(i))}});
  for (const auto& [a, b, correlation] : correlated_parameters(plan))
    pairs.push_back({{"parameters", {plan.parameters[a], plan.parameters[b]}}, {"correlation", correlation}});
  for (const PlanItem& item : plan.menu) menu.push_back(menu_json(plan, item));
  return {{"schema", "wheelhop.plan/1"},
          {"answer", plan_answer(plan)},
          {"noise", {{"std", std}, {"assumed_one_percent", assumed}}},
          {"effects", effects},
          {"parameters", parameters},
          {"correlated_parameters", pairs},
          {"menu_seconds", plan.menu_s},
          {"menu", menu},
          {"provenance", provenance(set)}};
}

}  // namespace

int run_plan(const PlanRequest& request) {
  FileUses uses;
  uses.reads_named("--plant", request.plant).reads_named("--records", request.records);
  if (!request.out.empty())
    uses.writes("--out", request.out);
  else
    require_standard_output();
  uses.check();
  Plant plant = unquantised(load_acting_plant(request.plant));  // steps of a converter have no slope; noise covers them
  const RecordSet set = load_records(request.records, plant.input_channels(), {}, plant.output_channels());
  require_sound_records(set, request.records);
  plant = with_drive_rate(std::move(plant), set);
  require_hold_rate(plant, set, request.records);
  Planned planned = at_records(set, request.records, [&] { return drives_of(plant, set); });
  Vector noise;
  std::vector<std::string> assumed;
  std::string message;
  Plan plan;
  plan.status = at_records(set, request.records, [&] {
    return plan_noise(plant, planned.records, set.noise_std, noise, assumed, plan.message);
  });
  if (plan.status == Status::ok) {
    for (FitRecord& record : planned.records) record.weight_std = record.weight_std.cwiseProduct(noise).eval();
    Operation operation;
    operation_of(plant, planned.records, {}, operation);
    std::vector<EffectCandidate> candidates = effect_candidates(plant, operation);
    std::erase_if(candidates, [](const EffectCandidate& candidate) { return !candidate.refines.empty(); });
    for (EffectCandidate& candidate : candidates) candidate = at_typical_size(std::move(candidate));
    plan = plan_test(plant, planned.records, planned.repeats, candidates, {}, [&](const std::string& what) {
      if (!request.quiet) std::fprintf(stderr, "plan: %s\n", what.c_str());
    });
  }
  if (plan.status != Status::ok) {
    std::fprintf(stderr, "wheelhop: the plant cannot follow the planned drives: %s\n", plan.message.c_str());
    return 1;
  }
  if (!request.out.empty()) write_json(request.out, to_json(plant, set, plan, noise, assumed));
  print_plan(plan, assumed);
  if (!request.out.empty()) fmt::print("\nwritten: {}\n", request.out.string());
  return 0;
}

}  // namespace wheelhop

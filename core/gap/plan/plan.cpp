#include "core/gap/plan/plan.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>
#include <numeric>

#include "core/data/metrics.hpp"
#include "core/gap/plan/plan_menu.hpp"
#include "core/gap/plan/responses.hpp"

namespace wheelhop {
namespace {

constexpr double kAssumedNoise = 0.01;  // of the RMS of an output
constexpr double kColumnBytes = 1e8;    // that the responses of all candidates may take at once, a judgement
constexpr double kComparable = 0.5;     // share of the best form's size from which a form counts in comparisons

/// The forms of one effect at one place.
struct Forms {
  EffectId effect;
  Place location;
  std::vector<std::size_t> candidates;
};

std::vector<Forms> groups_of(const std::vector<EffectCandidate>& candidates) {
  std::vector<Forms> groups;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Place& location = candidates[i].location;
    const auto same = [&](const Forms& group) {
      return group.effect == candidates[i].label().effect && group.location == location;
    };
    auto found = std::find_if(groups.begin(), groups.end(), same);
    if (found == groups.end()) found = groups.insert(found, {candidates[i].label().effect, location, {}});
    found->candidates.push_back(i);
  }
  return groups;
}

/// Pairs of effects, and of the forms of each: those of pair k are forms[first[k]] to forms[first[k + 1] - 1].
struct Comparisons {
  std::vector<EffectPair> effects = {};
  std::vector<std::size_t> first = {0};
  std::vector<CandidatePair> forms = {};

  Index begin(std::size_t k) const { return static_cast<Index>(first[k]); }
  Index count(std::size_t k) const { return static_cast<Index>(first[k + 1] - first[k]); }
};

void add_pair(const std::vector<Forms>& groups, EffectPair pair, Comparisons& comparisons) {
  for (const std::size_t a : groups[std::max(pair[0], pair[1])].candidates)
    for (const std::size_t b : groups[std::min(pair[0], pair[1])].candidates)
      comparisons.forms.push_back(
          {static_cast<std::uint32_t>(std::max(a, b)), static_cast<std::uint32_t>(std::min(a, b))});
  comparisons.effects.push_back(pair);
  comparisons.first.push_back(comparisons.forms.size());
}

Comparisons all_pairs(const std::vector<Forms>& groups) {
  Comparisons all;
  for (std::size_t i = 0; i < groups.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) add_pair(groups, {i, j}, all);
  return all;
}

/// Those that look alike as planned, then those that are compared in any case.
Comparisons pairs_for_menu(const std::vector<Forms>& groups, const Plan& plan,
                           const std::vector<EffectPair>& compared) {
  Comparisons some;
  for (const PlanPair& pair : plan.pairs) add_pair(groups, {pair.a, pair.b}, some);
  for (const EffectPair& pair : compared) add_pair(groups, pair, some);
  return some;
}

/// The products of some pairs, out of those of all.
Products among(const Products& known, const Comparisons& all, const Comparisons& some) {
  Products out{known.tangents, known.squares, Vector(static_cast<Index>(some.forms.size()))};
  for (std::size_t k = 0; k < some.effects.size(); ++k) {
    const auto [low, high] = std::minmax(some.effects[k][0], some.effects[k][1]);
    out.pairs.segment(some.begin(k), some.count(k)) =
        known.pairs.segment(all.begin(high * (high - 1) / 2 + low), some.count(k));
  }
  return out;
}

PlanView view_of(std::string name, const std::vector<Forms>& groups, const std::vector<EffectCandidate>& candidates,
                 const Visibility& seen) {
  PlanView view;
  view.name = std::move(name);
  view.parameter_std = seen.parameter_std;
  view.parameter_cosine = seen.parameter_cosine;
  for (const Forms& group : groups) {
    PlannedEffect best{group.effect, group.location, "", std::numeric_limits<double>::quiet_NaN()};
    for (const std::size_t c : group.candidates) {
      const double size = seen.size(static_cast<Index>(c));
      if (size <= best.size_sigma || !std::isfinite(size)) continue;
      best.form = form_of(candidates[c].label(), candidates[c].plant);
      best.size_sigma = size;
    }
    view.effects.push_back(std::move(best));
  }
  return view;
}

/// Of each pair of effects, that of the two forms most alike among those that show about as much as the best.
std::vector<double> cosines_of(const PlanView& view, const std::vector<Forms>& groups, const Comparisons& pairs,
                               const Visibility& seen) {
  const auto counts = [&](std::size_t group, std::size_t candidate) {
    return seen.size(static_cast<Index>(candidate)) >= kComparable * view.effects[group].size_sigma;
  };
  std::vector<double> cosines;
  for (std::size_t k = 0; k < pairs.effects.size(); ++k) {
    const auto [low, high] = std::minmax(pairs.effects[k][0], pairs.effects[k][1]);
    double most = 0;
    Index at = pairs.begin(k);
    for (const std::size_t a : groups[high].candidates)
      for (const std::size_t b : groups[low].candidates) {
        const double cosine = seen.cosine(at++);
        if (counts(high, a) && counts(low, b) && std::abs(cosine) > std::abs(most)) most = cosine;
      }
    cosines.push_back(most);
  }
  return cosines;
}

/// A further sensor is as noisy as the worst of its kind in the plant; without one, 1 % of what it reads.
/// @param readings nominal outputs of the plant with the sensor last
double noise_of(const Plant& plant, const Sensor& sensor, const FitRecord& record, ConstVectorRef readings) {
  double worst = 0;
  for (std::size_t i = 0; i < plant.sensors.size(); ++i)
    if (plant.sensors[i].kind == sensor.kind) worst = std::max(worst, record.weight_std(static_cast<Index>(i)));
  const double own = kAssumedNoise * readings.norm() / std::sqrt(static_cast<double>(readings.size()));
  return worst > 0 ? worst : own > 0 ? own : 1;
}

/// The first part of each drive.
std::vector<FitRecord> shortened(const Plant& plant, std::vector<FitRecord> records, double total_s) {
  const double each_s = total_s / static_cast<double>(records.size());
  for (FitRecord& record : records) {
    const double rate_hz = plant.hold_hz() / static_cast<double>(record.ratio);
    const Index samples = record.skip + std::max<Index>(2, std::llround(each_s * rate_hz));
    if (samples * record.ratio < record.drive.cols())
      record.drive = record.drive.leftCols(samples * record.ratio).eval();
  }
  return records;
}

/// Noise of the sensors that could be added, behind that of the plant's own.
Status add_noise_of(const Plant& plant, const std::vector<Sensor>& added, std::vector<FitRecord>& records,
                    std::string& message) {
  std::vector<FitRecord> runs = records;
  Vector ignored;
  std::vector<Vector> start;
  const Status status = nominal_outputs(extended(plant, {{}, added}), runs, ignored, start, message);
  if (status != Status::ok) return status;
  const Index own = plant.sensor_count();
  for (std::size_t r = 0; r < records.size(); ++r) {
    records[r].weight_std.conservativeResize(own + static_cast<Index>(added.size()));
    for (std::size_t s = 0; s < added.size(); ++s) {
      const Index row = own + static_cast<Index>(s);
      records[r].weight_std(row) = noise_of(plant, added[s], records[r], runs[r].y.row(row).transpose());
    }
  }
  return status;
}

/// A plan in the making: first the test as it is planned, then each item of the menu, of which only what it says of
/// pairs that look alike as planned is kept.
struct Planning {
  const Plant& plant;
  const std::vector<FitRecord>& records;
  const std::vector<EffectCandidate>& candidates;
  const PlanOptions& options;
  const PlanStep& step;

  Plan plan = {};
  std::vector<PlanItem> menu = {};
  std::vector<Forms> groups = groups_of(candidates);
  Comparisons pairs = all_pairs(groups);  ///< those that look alike, once these are known
  Responses planned = {};
  Products once = {};  ///< of the test as planned, summed over the plant's own sensors

  void say(const std::string& what) const {
    if (step) step(what);
  }
  Visibility see(const Responses& known, const Products& products) const {
    return visibility(known, products, pairs.forms, plant.sensor_count());
  }
  PlanItem item(const std::string& name, const Responses& known, const Products& products) const {
    const Visibility seen = see(known, products);
    PlanView view = view_of(name, groups, candidates, seen);
    std::vector<double> cosines = cosines_of(view, groups, pairs, seen);
    return judged(std::move(view), std::move(cosines), plan);
  }
  bool goes_on(const Responses& known) {
    plan.status = known.status;
    plan.message = known.message;
    return plan.status == Status::ok;
  }

  bool as_planned() {
    say("the test as planned");
    for (const FitParameter& parameter : tolerance_parameters(plant)) plan.parameters.push_back(parameter.name);
    planned = responses(plant, candidates, {}, records, {.pairs = pairs.forms, .bytes = kColumnBytes},
                        [&](const Responses&, Index, const Products& of_sensor) { once.add(of_sensor); });
    if (!goes_on(planned)) return false;
    const Visibility seen = see(planned, once);
    plan.planned = view_of("as planned", groups, candidates, seen);
    const std::vector<double> cosines = cosines_of(plan.planned, groups, pairs, seen);
    const Index count = static_cast<Index>(groups.size());
    plan.planned.cosine = Matrix::Identity(count, count);
    for (std::size_t k = 0; k < cosines.size(); ++k) {
      const auto i = static_cast<Index>(pairs.effects[k][0]), j = static_cast<Index>(pairs.effects[k][1]);
      plan.planned.cosine(i, j) = plan.planned.cosine(j, i) = cosines[k];
    }
    plan.pairs = pairs_of(plan.planned);
    Comparisons alike = pairs_for_menu(groups, plan, options.compared);
    once = among(once, pairs, alike);
    pairs = std::move(alike);
    return true;
  }

  void with_repeats(Index repeats) {
    const double more = repeats < 4 ? 4 : 2 * static_cast<double>(repeats);
    Products repeated;
    repeated.add(once, more / static_cast<double>(repeats));
    menu.push_back(item(fmt::format("with {:g} repeats of the drive", more), planned, repeated));
  }

  bool with_sensors() {
    const std::vector<MenuSensor> sensors = menu_sensors(plant);
    if (sensors.empty()) return true;
    say("further sensors");
    const Index own = plant.sensor_count();
    std::vector<Sensor> added;
    for (const MenuSensor& sensor : sensors) added.push_back(sensor.sensor);
    std::vector<FitRecord> read = records;
    plan.status = add_noise_of(plant, added, read, plan.message);
    if (plan.status != Status::ok) return false;
    return goes_on(responses(plant, candidates, {{}, added}, std::move(read), {own, pairs.forms, kColumnBytes},
                             [&](const Responses& known, Index sensor, Products products) {
                               products.add(once);
                               menu.push_back(
                                   item(sensors[static_cast<std::size_t>(sensor - own)].name, known, products));
                             }));
  }

  void with_other_drives() {
    std::vector<FitRecord> nominal = shortened(plant, records, options.menu_s);
    Vector ignored;
    std::vector<Vector> start;
    nominal_outputs(plant, nominal, ignored, start, plan.message);
    for (const FitRecord& record : nominal)
      plan.menu_s = std::max(plan.menu_s, static_cast<double>(record.drive.cols()) / plant.hold_hz());
    std::vector<MenuDrive> drives = menu_drives(plant, nominal);
    std::vector<PlanItem> driven(drives.size());
    const std::size_t at_once = std::min(std::max<std::size_t>(drives.size(), 1),
                                         static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()));
    std::mutex saying;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, drives.size(), 1), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        MenuDrive& drive = drives[i];
        {
          const std::lock_guard lock(saying);
          say(drive.name);
        }
        Products all;
        const Responses known =
            responses(plant, candidates, {drive.inputs, {}}, std::move(drive.records),
                      {.pairs = pairs.forms, .bytes = kColumnBytes / static_cast<double>(at_once)},
                      [&](const Responses&, Index, const Products& of_sensor) { all.add(of_sensor); });
        if (known.status == Status::ok) {
          driven[i] = item(drive.name, known, all);
        } else {
          driven[i].view.name = drive.name;
          driven[i].view.message = known.message;
        }
      }
    });
    std::move(driven.begin(), driven.end(), std::back_inserter(menu));
  }
};

}  // namespace

Status plan_noise(const Plant& plant, std::vector<FitRecord> records, const std::map<std::string, double>& known,
                  Vector& std, std::vector<std::string>& assumed, std::string& message) {
  Vector ignored, level = Vector::Zero(plant.sensor_count());
  std::vector<Vector> start;
  if (const Status status = nominal_outputs(plant, records, ignored, start, message); status != Status::ok)
    return status;
  for (const FitRecord& record : records) level = level.cwiseMax(rms(record.y, record.skip));
  std.resize(plant.sensor_count());
  assumed.clear();
  for (std::size_t i = 0; i < plant.sensors.size(); ++i) {
    const Sensor& sensor = plant.sensors[i];
    double& own = std(static_cast<Index>(i));
    if (const auto found = known.find(sensor.name); found != known.end()) {
      own = found->second;
      continue;
    }
    assumed.push_back(sensor.name);
    own = kAssumedNoise * level(static_cast<Index>(i));
    for (std::size_t j = 0; j < plant.sensors.size() && !(own > 0); ++j)
      if (plant.sensors[j].unit == sensor.unit) own = kAssumedNoise * level(static_cast<Index>(j));
    if (!(own > 0))
      throw UserError(
          fmt::format("output \"{}\": no noise is known and it does not move under the drives; give its "
                      "noise_std in the record set",
                      sensor.name));
  }
  return Status::ok;
}

Plan plan_test(const Plant& plant, const std::vector<FitRecord>& records, Index repeats,
               const std::vector<EffectCandidate>& candidates, const PlanOptions& options, const PlanStep& step) {
  Planning planning{plant, records, candidates, options, step};
  if (!planning.as_planned()) return planning.plan;
  planning.with_repeats(repeats);
  if (!planning.with_sensors()) return planning.plan;
  planning.with_other_drives();
  choose(planning.plan, std::move(planning.menu));
  return std::move(planning.plan);
}

}  // namespace wheelhop

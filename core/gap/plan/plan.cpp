#include "core/gap/plan/plan.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

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
constexpr double kComparable = 0.5;     // share of the best form's size from which a form counts in comparisons

/// The forms of one effect at one place.
struct Forms {
  std::string effect, location;
  std::vector<std::size_t> candidates;
};

std::vector<Forms> groups_of(const std::vector<EffectCandidate>& candidates) {
  std::vector<Forms> groups;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const std::string& location = candidates[i].location;
    const auto same = [&](const Forms& group) {
      return group.effect == candidates[i].effect && group.location == location;
    };
    auto found = std::find_if(groups.begin(), groups.end(), same);
    if (found == groups.end()) found = groups.insert(found, {candidates[i].effect, location, {}});
    found->candidates.push_back(i);
  }
  return groups;
}

PlanView view_of(std::string name, const std::vector<Forms>& groups, const std::vector<EffectCandidate>& candidates,
                 const Visibility& seen) {
  PlanView view;
  view.name = std::move(name);
  view.parameter_std = seen.parameter_std;
  view.parameter_cosine = seen.parameter_cosine;
  const auto size = [&](std::size_t candidate) { return seen.size(static_cast<Index>(candidate)); };
  for (const Forms& group : groups) {
    PlannedEffect best{group.effect, group.location, "", std::numeric_limits<double>::quiet_NaN()};
    for (const std::size_t c : group.candidates)
      if (!(size(c) <= best.size_sigma) && std::isfinite(size(c))) {
        best.form = candidates[c].form;
        best.size_sigma = size(c);
      }
    view.effects.push_back(std::move(best));
  }
  const Index count = static_cast<Index>(groups.size());
  view.cosine = Matrix::Identity(count, count);
  const auto counts = [&](std::size_t group, std::size_t candidate) {
    return size(candidate) >= kComparable * view.effects[group].size_sigma;
  };
  for (std::size_t i = 0; i < groups.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      double most = 0;
      for (const std::size_t a : groups[i].candidates)
        for (const std::size_t b : groups[j].candidates) {
          const double cosine = seen.cosine(static_cast<Index>(a), static_cast<Index>(b));
          if (counts(i, a) && counts(j, b) && std::abs(cosine) > std::abs(most)) most = cosine;
        }
      view.cosine(static_cast<Index>(i), static_cast<Index>(j)) = most;
      view.cosine(static_cast<Index>(j), static_cast<Index>(i)) = most;
    }
  return view;
}

std::vector<Index> first(Index count) {
  std::vector<Index> list(static_cast<std::size_t>(count));
  std::iota(list.begin(), list.end(), Index{0});
  return list;
}

/// The plants of candidates, with further inputs and sensors behind their own.
Plant extended(Plant plant, const std::vector<PlantInput>& inputs, const std::vector<Sensor>& sensors) {
  plant.inputs.insert(plant.inputs.end(), inputs.begin(), inputs.end());
  plant.sensors.insert(plant.sensors.end(), sensors.begin(), sensors.end());
  return plant;
}
std::vector<EffectCandidate> extended(std::vector<EffectCandidate> candidates, const std::vector<PlantInput>& inputs,
                                      const std::vector<Sensor>& sensors) {
  for (EffectCandidate& candidate : candidates) candidate.plant = extended(std::move(candidate.plant), inputs, sensors);
  return candidates;
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

/// The planned drives with every sensor that could be added: read with or without them, they are several items.
struct Bench {
  std::vector<MenuSensor> sensors;
  Responses responses;
};

Bench with_all_sensors(const Plant& plant, std::vector<FitRecord> records,
                       const std::vector<EffectCandidate>& candidates) {
  Bench bench;
  std::vector<Sensor> added;
  for (MenuSensor& sensor : menu_sensors(plant)) {
    added.push_back(sensor.sensor);
    bench.sensors.push_back(std::move(sensor));
  }
  const Plant whole = extended(plant, {}, added);
  std::vector<FitRecord> runs = records;
  Vector ignored;
  std::vector<Vector> start;
  bench.responses.status = nominal_outputs(whole, runs, ignored, start, bench.responses.message);
  if (bench.responses.status != Status::ok) return bench;
  const Index own = plant.sensor_count();
  for (std::size_t r = 0; r < records.size(); ++r) {
    records[r].weight_std.conservativeResize(own + static_cast<Index>(added.size()));
    for (std::size_t s = 0; s < added.size(); ++s) {
      const Index row = own + static_cast<Index>(s);
      records[r].weight_std(row) = noise_of(plant, added[s], records[r], runs[r].y.row(row).transpose());
    }
  }
  bench.responses = responses(whole, extended(candidates, {}, added), std::move(records));
  return bench;
}

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
  Plan plan;
  for (const FitParameter& parameter : tolerance_parameters(plant)) plan.parameters.push_back(parameter.name);
  const std::vector<Forms> groups = groups_of(candidates);
  const Index own = plant.sensor_count();
  const auto say = [&](const std::string& what) {
    if (step) step(what);
  };

  say("the test as planned");
  const Bench bench = with_all_sensors(plant, records, candidates);
  plan.status = bench.responses.status;
  plan.message = bench.responses.message;
  if (plan.status != Status::ok) return plan;
  const auto read = [&](const std::string& name, const Responses& from, std::vector<Index> sensors, double power) {
    return view_of(name, groups, candidates, visibility(from, sensors, power, own));
  };
  plan.planned = read("as planned", bench.responses, first(own), 1);
  std::vector<PlanView> menu;

  const double more = repeats < 4 ? 4 : 2 * static_cast<double>(repeats);
  menu.push_back(read(fmt::format("with {:g} repeats of the drive", more), bench.responses, first(own),
                      more / static_cast<double>(repeats)));
  for (std::size_t s = 0; s < bench.sensors.size(); ++s) {
    std::vector<Index> sensors = first(own);
    sensors.push_back(own + static_cast<Index>(s));
    menu.push_back(read(bench.sensors[s].name, bench.responses, sensors, 1));
  }
  std::vector<FitRecord> nominal = shortened(plant, records, options.menu_s);
  Vector ignored;
  std::vector<Vector> start;
  nominal_outputs(plant, nominal, ignored, start, plan.message);
  for (const FitRecord& record : nominal)
    plan.menu_s = std::max(plan.menu_s, static_cast<double>(record.drive.cols()) / plant.hold_hz());
  std::vector<MenuDrive> drives = menu_drives(plant, nominal);
  std::vector<PlanView> driven(drives.size());
  std::mutex saying;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, drives.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      MenuDrive& item = drives[i];
      {
        const std::lock_guard lock(saying);
        say(item.name);
      }
      const Responses seen =
          responses(extended(plant, item.inputs, {}), extended(candidates, item.inputs, {}), std::move(item.records));
      if (seen.status == Status::ok) {
        driven[i] = read(item.name, seen, first(own), 1);
      } else {
        driven[i].name = item.name;
        driven[i].message = seen.message;
      }
    }
  });
  std::move(driven.begin(), driven.end(), std::back_inserter(menu));
  judge(plan, std::move(menu));
  return plan;
}

}  // namespace wheelhop

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
constexpr double kColumnBytes = 5e8;    // that the responses of all candidates may take at once, a judgement
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
        best.form = form_of(candidates[c].label(), candidates[c].plant);
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

/// Sum of the products of sensors, each times a factor.
class Sum {
 public:
  explicit Sum(double factor) : factor_(factor) {}
  void add(const Matrix& gram) {
    if (sum_.size() == 0) sum_ = Matrix::Zero(gram.rows(), gram.cols());
    sum_ += factor_ * gram;
  }
  const Matrix& value() const { return sum_; }

 private:
  double factor_;
  Matrix sum_;
};

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

  const auto view = [&](const std::string& name, const Responses& known, const Matrix& gram) {
    return view_of(name, groups, candidates, visibility(known, gram, own));
  };
  // Of an item of the menu only what it says of pairs that look alike as planned is kept.
  std::vector<PlanItem> menu;
  const auto offer = [&](PlanView seen) { menu.push_back(judged(std::move(seen), plan, options.compared)); };

  say("the test as planned");
  std::vector<Sensor> added;
  const std::vector<MenuSensor> sensors = menu_sensors(plant);
  for (const MenuSensor& sensor : sensors) added.push_back(sensor.sensor);
  std::vector<FitRecord> read = records;
  plan.status = add_noise_of(plant, added, read, plan.message);
  if (plan.status != Status::ok) return plan;
  const double more = repeats < 4 ? 4 : 2 * static_cast<double>(repeats);
  Sum once(1), repeated(more / static_cast<double>(repeats));
  const Responses planned = responses(
      plant, candidates, {{}, added}, std::move(read), kColumnBytes,
      [&](const Responses& known, Index sensor, const Matrix& gram) {
        if (sensor >= own)
          return offer(view(sensors[static_cast<std::size_t>(sensor - own)].name, known, once.value() + gram));
        once.add(gram);
        repeated.add(gram);
        if (sensor + 1 < own) return;
        plan.planned = view("as planned", known, once.value());
        plan.pairs = pairs_of(plan.planned);
        offer(view(fmt::format("with {:g} repeats of the drive", more), known, repeated.value()));
      });
  plan.status = planned.status;
  plan.message = planned.message;
  if (plan.status != Status::ok) return plan;
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
      MenuDrive& item = drives[i];
      {
        const std::lock_guard lock(saying);
        say(item.name);
      }
      Sum all(1);
      const Responses seen = responses(plant, candidates, {item.inputs, {}}, std::move(item.records),
                                       kColumnBytes / static_cast<double>(at_once),
                                       [&](const Responses&, Index, const Matrix& gram) { all.add(gram); });
      PlanView shown;
      shown.name = item.name;
      shown.message = seen.message;
      if (seen.status == Status::ok) shown = view(item.name, seen, all.value());
      driven[i] = judged(std::move(shown), plan, options.compared);
    }
  });
  std::move(driven.begin(), driven.end(), std::back_inserter(menu));
  choose(plan, std::move(menu));
  return plan;
}

}  // namespace wheelhop

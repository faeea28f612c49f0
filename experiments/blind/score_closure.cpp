#include "experiments/blind/score_closure.hpp"

#include <limits>

#include "core/greybox/plant_fit.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

namespace wheelhop::scoring {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Index kIterations = 12;
constexpr Index kStart = 8;  // the eighth of a record in which the motion forgets how it started

Vector floor_of(const Answer& answer, const Plant& plant) {
  Vector floor = Vector::Zero(plant.sensor_count());
  for (Index i = 0; i < floor.size(); ++i)
    for (const auto& [channel, value] : answer.floor)
      if (channel == plant.sensors[static_cast<std::size_t>(i)].name) floor(i) = value;
  return floor;
}

std::optional<double> closure_over(const std::vector<const Record*>& records, const Plant& before, const Plant& after,
                                   ConstVectorRef floor) {
  if (records.empty()) return std::nullopt;
  const double left = noise_free_misfit(after, records, floor), whole = noise_free_misfit(before, records, floor);
  if (!std::isfinite(left)) return -kInfinity;
  if (!std::isfinite(whole)) return 1;  // only the answer can follow the drive
  return 1 - left / whole;
}

}  // namespace

double noise_free_misfit(const Plant& plant, const std::vector<const Record*>& records, ConstVectorRef floor) {
  std::vector<FitRecord> prepared;
  for (const Record* record : records) prepared.push_back(fit_record(plant, record->signal, floor));
  const auto solver = make_levenberg_marquardt({.relative_decrease = 1e-4});
  const PlantFit fit = fit_plant(plant, {}, prepared, *solver, {kIterations});
  if (fit.error.size() != prepared.size()) return kInfinity;
  double sum = 0, count = 0;
  for (const Matrix& error : fit.error) {
    const Matrix r = floor.cwiseInverse().asDiagonal() * error.rightCols(error.cols() - error.cols() / kStart);
    sum += r.squaredNorm();
    count += static_cast<double>(r.size());
  }
  return sum / count;
}

void measure_closure(Judged& judged, const std::filesystem::path& answers, const std::filesystem::path& truth) {
  const Answer& answer = judged.answer;
  if (!std::filesystem::exists(truth / "records.json")) return;
  if (answer.absent || !answer.error.empty()) judged.true_closure = judged.beyond_closure = 0;
  if (answer.plant.empty() || answer.retuned.empty()) return;
  Plant before = load_plant(answers / answer.retuned), after = load_plant(answers / answer.plant);
  const Vector floor = floor_of(answer, before);
  if (!(floor.minCoeff() > 0)) return;
  const RecordSet set = load_records(truth / "records.json", before.input_channels(), before.output_channels());
  before = with_drive_rate(std::move(before), set);
  after = with_drive_rate(std::move(after), set);
  std::vector<const Record*> inside, beyond;
  for (const Record& record : set.records)
    (std::filesystem::path(record.file).filename().string().starts_with("beyond") ? beyond : inside).push_back(&record);
  judged.true_closure = closure_over(inside, before, after, floor);
  judged.beyond_closure = closure_over(beyond, before, after, floor);
}

}  // namespace wheelhop::scoring

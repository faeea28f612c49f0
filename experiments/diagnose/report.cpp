#include "experiments/diagnose/report.hpp"

#include <algorithm>
#include <cmath>

#include "core/plant/rotary.hpp"

namespace wheelhop {
namespace {

constexpr double kSegment_s = 1;
constexpr Index kLeastSamples = 60, kMostSamples = 400;  // of the segment: a picture has so many pixels
constexpr std::size_t kMostChannels = 3;
constexpr Index kMostPoints = 1500;
constexpr std::size_t kMedians = 25;

/// Figures need no more than a screen shows.
double rounded(double value) {
  if (value == 0 || !std::isfinite(value)) return value;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 5);
  return std::round(value / unit) * unit;
}

Json row(ConstVectorRef values) {
  Json out = Json::array();
  for (const double value : values) out.push_back(rounded(value));
  return out;
}

/// The stretch in which the error as delivered is largest, and the channels in which it is.
Json segment_json(const Plant& plant, const Examination& examination) {
  const StageExamination& delivered = examination.stages[0];
  Index length = std::llround(kSegment_s / examination.sample_time_s);
  length = std::clamp(length, kLeastSamples, kMostSamples);
  std::size_t record = 0;
  Index first = 0;
  double worst = -1;
  for (std::size_t i = 0; i < examination.records.size(); ++i) {
    const FitRecord& own = examination.records[i];
    const Vector power =
        (own.weight_std.cwiseInverse().asDiagonal() * delivered.fit.error[i]).colwise().squaredNorm().transpose();
    length = std::min(length, power.size() - own.skip);
    double sum = power.segment(own.skip, length).sum();
    for (Index k = own.skip;; ++k) {
      if (sum > worst) {
        worst = sum;
        record = i;
        first = k;
      }
      if (k + length >= power.size()) break;
      sum += power(k + length) - power(k);
    }
  }
  const FitRecord& chosen = examination.records[record];
  first = std::min(first, chosen.y.cols() - length);
  std::vector<std::pair<double, Index>> channels;
  for (Index c = 0; c < plant.sensor_count(); ++c)
    channels.push_back({delivered.fit.error[record].row(c).segment(first, length).norm() / chosen.weight_std(c), c});
  std::stable_sort(channels.begin(), channels.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  channels.resize(std::min(channels.size(), kMostChannels));
  Json out = {{"record", examination.names[record]},
              {"from_s", rounded(static_cast<double>(first) * examination.sample_time_s)},
              {"time_s", Json::array()},
              {"channels", Json::array()}};
  for (Index k = first; k < first + length; ++k)
    out["time_s"].push_back(rounded(static_cast<double>(k) * examination.sample_time_s));
  for (const auto& [size, c] : channels) {
    const Sensor& sensor = plant.sensors[static_cast<std::size_t>(c)];
    const Vector measured = chosen.y.row(c).segment(first, length);
    Json own = {{"channel", sensor.name},
                {"unit", sensor.unit},
                {"noise_std", chosen.weight_std(c)},
                {"measured", row(measured)}};
    for (std::size_t s = 0; s < kStageNames.size(); ++s)
      if (const StageExamination& stage = examination.stages[s]; stage.ran)
        own[kStageNames[s]] = row(measured + stage.fit.error[record].row(c).segment(first, length).transpose());
    out["channels"].push_back(std::move(own));
  }
  return out;
}

Json regions_json(const Plant& plant, const StageExamination& stage) {
  Json out = Json::array();
  for (const RegionShare& region : stage.profile.regions) {
    if (out.empty() || out.back().at("variable") != region.variable)
      out.push_back(
          {{"variable", region.variable}, {"unit", motion_unit(plant, region.variable)}, {"bins", Json::array()}});
    out.back()["bins"].push_back({{"from", rounded(region.from)},
                                  {"to", rounded(region.to)},
                                  {"share", rounded(region.share)},
                                  {"time_share", rounded(region.time_share)}});
  }
  return out;
}

/// Medians of y over bins of x that hold equally many samples.
Json medians_json(const Vector& x, const Vector& y) {
  std::vector<std::pair<double, double>> pairs;
  for (Index k = 0; k < x.size(); ++k) pairs.push_back({x(k), y(k)});
  std::sort(pairs.begin(), pairs.end());
  Json out = Json::array();
  const std::size_t bins = std::min(kMedians, pairs.size());
  for (std::size_t b = 0; b < bins; ++b) {
    const std::size_t from = b * pairs.size() / bins, to = (b + 1) * pairs.size() / bins;
    std::vector<double> values;
    for (std::size_t k = from; k < to; ++k) values.push_back(pairs[k].second);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    out.push_back({rounded(pairs[(from + to) / 2].first), rounded(*middle)});
  }
  return out;
}

struct FigureAxis {
  std::string name, unit;
  Vector values;
};

/// What an unknown signal is drawn over: travel and rate of its element (of the first at a mass or drive), or the
/// simulated reading of its sensor.
std::vector<FigureAxis> axes_of(const Plant& plant, const Examination& examination) {
  const Place& place = examination.unknown.location;
  for (Index c = 0; c < plant.sensor_count(); ++c) {
    const Sensor& sensor = plant.sensors[static_cast<std::size_t>(c)];
    if (place == sensor_place(sensor.name))
      return {{sensor.name + ", simulated", sensor.unit, examination.unknown_outputs.row(c).transpose()}};
  }
  const auto drives = [&](const std::string& node) {
    return std::any_of(plant.inputs.begin(), plant.inputs.end(),
                       [&](const PlantInput& input) { return input.name == node; });
  };
  for (std::size_t e = 0; e < plant.elements.size(); ++e) {
    const Element& element = plant.elements[e];
    const bool here = place == location_of(element) || place == guide_place(element.from) ||
                      place == guide_place(element.to) ||
                      (place.kind == PlaceKind::actuator && (drives(element.from) || drives(element.to)));
    if (!here) continue;
    const auto i = static_cast<Index>(e);
    const std::string unit = is_rotary(plant, element) ? "rad" : "m";
    return {{element.name + " travel", unit, examination.unknown_motion.travel.row(i).transpose()},
            {element.name + " velocity", unit + "/s", examination.unknown_motion.rate.row(i).transpose()}};
  }
  return {};
}

Json unknown_json(const Plant& plant, const Examination& examination) {
  const UnknownSignal& unknown = examination.unknown;
  if (unknown.status != Status::ok) return {};
  const Index skip = examination.records[0].skip, kept = unknown.value.size() - skip;
  const Index fade = kept / 20, used = kept - 2 * fade;  // its ends fade
  const Vector value = unknown.value.segment(skip + fade, used);
  const Index step = (used + kMostPoints - 1) / kMostPoints;
  const auto thinned = [&](const Vector& x) {
    Vector out((used + step - 1) / step);
    for (Index k = 0; k < out.size(); ++k) out(k) = x(k * step);
    return row(out);
  };
  Json out = {{"location", unknown.location},   {"unit", unknown.unit},       {"rms", unknown.rms},
              {"noise_rms", unknown.noise_rms}, {"band_hz", unknown.band_hz}, {"value", thinned(value)},
              {"axes", Json::array()}};
  for (const FigureAxis& axis : axes_of(plant, examination)) {
    const Vector x = axis.values.segment(skip + fade, used);
    out["axes"].push_back(
        {{"name", axis.name}, {"unit", axis.unit}, {"values", thinned(x)}, {"medians", medians_json(x, value)}});
  }
  return out;
}

}  // namespace

Place place_of_note(const Diagnosis& diagnosis) {
  if (is<NoGap>(diagnosis.verdict)) return {};
  if (diagnosis.evidence.places.empty())
    return diagnosis.verdict.locations.empty() ? Place{} : diagnosis.verdict.locations.front().location;
  if (!diagnosis.verdict.locations.empty())
    for (const PlaceLeftover& place : diagnosis.evidence.places) {
      const Place& wanted = diagnosis.verdict.locations.front().location;
      for (const Place& entry : entries_of(place))
        if (entry == wanted || without_guide(entry) == wanted) return place.location;  // a guide: a force on its mass
    }
  return diagnosis.evidence.places.front().location;
}

Place place_of_ceiling(const Diagnosis& diagnosis) {
  const bool clock =
      !diagnosis.verdict.locations.empty() && diagnosis.verdict.locations.front().location == clock_place();
  return clock && !is<NoGap>(diagnosis.verdict) ? clock_place() : place_of_note(diagnosis);
}

Json diagnosis_figures_json(const Plant& plant, const Examination& examination) {
  Json out = {{"schema", "wheelhop.diagnosis_figures/1"}, {"segment", Json()}, {"regions", Json::array()}};
  if (examination.stages[0].ran) out["segment"] = segment_json(plant, examination);
  if (const int stage = telling_stage(examination); stage >= 0) {
    out["regions"] = regions_json(plant, examination.stages[static_cast<std::size_t>(stage)]);
    out["regions_of"] = kStageNames[static_cast<std::size_t>(stage)];
  }
  out["unknown_signal"] = unknown_json(plant, examination);
  return out;
}

std::filesystem::path figures_beside(const std::filesystem::path& diagnosis) {
  std::filesystem::path beside = diagnosis;
  return beside.replace_extension(".figures.json");
}

}  // namespace wheelhop

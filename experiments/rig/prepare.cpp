#include "experiments/rig/prepare.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/rig/retuning.hpp"

namespace wheelhop::blind {
namespace {

/// Accuracy of the runs that only find a size: four orders below the noise.
constexpr double search_accuracy = 1e-6;

Range gap_range(const std::string& strength_class) {
  if (strength_class == "weak") return {0.3, 0.7};
  return strength_class == "medium" ? Range{0.7, 2} : Range{2, 6};
}

std::string strength_of(double gap) {
  for (const char* name : {"weak", "medium"})
    if (gap < gap_range(name).high) return name;
  return "strong";
}

/// What a wrong parameter must leave where all others are re-tuned, over the noise. Less than a weak effect, since the
/// others take over most of it (masses, springs and dampers are known up to one common scale): over 2000 samples of
/// three channels it makes 60 in chi-square, five times what BIC asks of a parameter in the diagnosis' design (12).
constexpr double least_of_note = 0.1;

/// Standard normal, not beyond two.
double within_two(Random& random) {
  for (;;)
    if (const double value = random.normal(); std::abs(value) <= 2) return value;
}

Surroundings surroundings(const TrueSystem& plain, const Observation& seen, const CaseSpec& spec) {
  Surroundings rig{spec.plan.get(), plain.theta, seen.elements, seen.masses};
  const auto count = static_cast<double>(seen.clean.cols());
  const Vector mean = seen.clean.rowwise().mean();
  rig.sensor_rms = (seen.clean.rowwise().squaredNorm() / count).cwiseSqrt();
  rig.sensor_std = ((seen.clean.colwise() - mean).rowwise().squaredNorm() / count).cwiseSqrt();
  rig.input_peak = seen.command.cwiseAbs().rowwise().maxCoeff();
  const Matrix speed =
      (seen.command.rightCols(seen.command.cols() - 1) - seen.command.leftCols(seen.command.cols() - 1)) * record_hz;
  rig.input_speed_rms = (speed.rowwise().squaredNorm() / count).cwiseSqrt();
  const Matrix rate =
      (seen.clean.rightCols(seen.clean.cols() - 1) - seen.clean.leftCols(seen.clean.cols() - 1)) * record_hz;
  rig.sensor_rate_rms = (rate.rowwise().squaredNorm() / count).cwiseSqrt();
  rig.static_load_n = static_loads(*spec.plan);
  rig.band_hz = spec.drive.name == "band_limited_10hz" ? 10 : spec.drive.to_hz;
  rig.duration_s = count / record_hz;
  return rig;
}

/// Rounds of re-tuning while a size is sought, and for the gap that the key tells.
constexpr int search_rounds = 1, key_rounds = 4;

/// How near, as a ratio, a search comes to its target.
constexpr double search_ratio = 1.05;

struct Search {
  double size = 0, gap = 0;  ///< best found
};

/// Finds the size at which `gap` is `target`; at most 14 calls. The gap grows with the size, often in proportion.
template <class Gap>
Search find_size(double smallest, double largest, double target, Gap gap) {
  double low = smallest, high = largest, size = std::sqrt(smallest * largest);
  bool high_tried = false;
  Search best;
  for (int call = 0; call < 14; ++call) {
    const double found = gap(size);
    if (best.size == 0 || std::abs(std::log(found / target)) < std::abs(std::log(best.gap / target)))
      best = {size, found};
    if (std::abs(std::log(found / target)) < std::log(search_ratio)) break;
    if (found < target) {
      if (size >= largest) break;  // even the largest is too weak
      low = size;
    } else {
      high = size;
      high_tried = true;
    }
    double next = std::isfinite(found) && found > 0 ? size * target / found : 0;
    if (!high_tried && next >= high)
      next = largest;
    else if (next <= low * 1.001 || next >= high * 0.999)
      next = std::sqrt(low * high);
    size = next;
  }
  return best;
}

class Preparation {
 public:
  explicit Preparation(const CaseSpec& spec) : random_(spec.seed, Stream::parameters, spec.number, 1) {
    done_.spec = spec;
    done_.system.plan = spec.plan.get();
    options_ = {.samples = spec.samples, .accuracy = search_accuracy};
    playback_ = play(*spec.plan, commands_of(spec, Realisation::estimation), options_);
  }

  Prepared run() {
    draw_parameters();
    done_.noise_relative = between(random_, done_.spec.noise_low, done_.spec.noise_high);
    plain_ = done_.system;
    const bool mixed = done_.spec.case_class == "mixed";
    if (mixed) draw_wrong_parameter();
    base_ = observe(plain_, playback_, options_);
    rig_ = surroundings(plain_, base_, done_.spec);
    done_.noise_std = done_.noise_relative * rig_.sensor_std;
    retuning_.emplace(plain_, playback_, options_, base_.clean, done_.noise_std, off_);
    std::vector<TrueEffect> effects;
    for (const Wanted& wanted : done_.spec.effects) {
      if (mixed && &wanted == &done_.spec.effects.back()) break;  // the parameter, drawn above
      const std::optional<Formed> formed = wanted.kind->form_at(rig_, wanted.place, random_);
      if (!formed) return unreachable(wanted, "this rig leaves it nothing to work on");
      if (done_.spec.case_class == "parameter") {
        effects.push_back(formed->at_size(drawn_tolerances(*formed)));
        continue;
      }
      const bool given = done_.spec.size.second > 0;
      const std::optional<double> size = given ? drawn_size(*formed) : size_for_gap(*formed);
      if (!size) return unreachable(wanted, why_);
      effects.push_back(formed->at_size(*size));
    }
    const Matrix change = change_by(effects);
    if (done_.spec.case_class != "parameter") done_.gap_sigma = retuning_->left_of(change, key_rounds);
    done_.delivered_sigma = retuning_->delivered(change);
    if (done_.spec.size.second > 0) done_.spec.strength_class = strength_of(done_.gap_sigma);
    if (mixed) {
      const Index at = wrong_.factors.front().first;
      done_.parameter_sigma = retuning_->left_holding(at);
      if (done_.parameter_sigma < least_of_note)
        return unreachable(done_.spec.effects.back(), "the other parameters hide it: it leaves " +
                                                          std::to_string(done_.parameter_sigma) + " sigma");
      effects.push_back(wrong_);
    }
    done_.system.effects = std::move(effects);
    return std::move(done_);
  }

 private:
  void draw_parameters() {
    const Vector nominal = done_.spec.plan->nominal();
    off_.resize(nominal.size());
    done_.system.theta = nominal;
    for (Index i = 0; i < nominal.size(); ++i) {
      off_(i) = within_two(random_);
      done_.system.theta(i) *= 1 + off_(i) * done_.spec.plan->parameters[static_cast<std::size_t>(i)].tolerance;
    }
  }

  /// Of class mixed: the plant without the effect is the one with the wrong parameter, and re-tuning has the whole way
  /// to go from the delivered value.
  void draw_wrong_parameter() {
    const Wanted& wanted = done_.spec.effects.back();
    const Surroundings before{.plan = done_.spec.plan.get(), .theta = done_.system.theta};
    const std::optional<Formed> formed = wanted.kind->form_at(before, wanted.place, random_);
    if (!formed) throw std::logic_error("blind: no parameter of " + wanted.place);
    wrong_ = formed->at_size(drawn_tolerances(*formed));
    for (const auto& [at, factor] : wrong_.factors) {
      const Parameter& parameter = done_.spec.plan->parameters[static_cast<std::size_t>(at)];
      plain_.theta(at) *= factor;
      if (parameter.tolerance > 0) off_(at) = (plain_.theta(at) / parameter.value - 1) / parameter.tolerance;
    }
  }

  Matrix change_by(const std::vector<TrueEffect>& effects) const {
    TrueSystem system = plain_;
    system.effects = effects;
    Matrix y = observe(system, playback_, options_).clean;
    convert(system, y);
    return y - base_.clean;
  }

  /// The size for a gap, by quick re-tuning first; where careful re-tuning then finds another gap, for a corrected
  /// target.
  Search sized(const Formed& formed, double target, Range range) const {
    double aim = target;
    Search found;
    for (int attempt = 0; attempt < 3; ++attempt) {
      found = find_size(formed.smallest, formed.largest, aim,
                        [&](double size) { return gap_of({formed.at_size(size)}, search_rounds); });
      found.gap = gap_of({formed.at_size(found.size)}, key_rounds);
      if (found.gap >= range.low && found.gap <= range.high) break;
      aim *= target / found.gap;
    }
    return found;
  }

  /// The size that leaves a gap drawn in the range of the strength; empty, with the reason kept, where none does.
  std::optional<double> size_for_gap(const Formed& formed) {
    const Range range = gap_range(done_.spec.strength_class);
    const double target = log_between(random_, range.low * search_ratio, range.high / search_ratio);
    const Search found = sized(formed, target, range);
    if (found.gap >= range.low && found.gap <= range.high) return found.size;
    why_ = "no size gives the gap of " + std::to_string(target) + " sigma; nearest " + std::to_string(found.gap);
    return std::nullopt;
  }

  /// The size that the config asks for, whatever gap it leaves; empty, with the reason kept, where it is not physical.
  std::optional<double> drawn_size(const Formed& formed) {
    const auto [low, high] = done_.spec.size;
    const double size = log_between(random_, low, high);
    if (size >= formed.smallest && size <= formed.largest) return size;
    why_ = "a size of " + std::to_string(size) + " lies outside what is physical";
    return std::nullopt;
  }

  double gap_of(const std::vector<TrueEffect>& effects, int rounds) const {
    try {
      return retuning_->left_of(change_by(effects), rounds);
    } catch (const RigFailure&) {
      return std::numeric_limits<double>::infinity();  // too strong for the plant's laws
    }
  }

  double drawn_tolerances(const Formed& formed) {
    const double third = (formed.largest - formed.smallest) / 3;
    const double from = done_.spec.strength_class == "weak" ? 0 : done_.spec.strength_class == "medium" ? 1 : 2;
    return formed.smallest + third * (from + random_.uniform());
  }

  Prepared unreachable(const Wanted& wanted, const std::string& why) {
    done_.unreachable = wanted.kind->effect + "@" + wanted.place + " (" + wanted.kind->form + "): " + why;
    return std::move(done_);
  }

  Prepared done_;
  TrueSystem plain_;  ///< without the effects, with the wrong parameter of class mixed
  TrueEffect wrong_;  ///< that parameter
  std::string why_;   ///< no size was found
  Random random_;
  ObserveOptions options_;
  Playback playback_;
  Vector off_;
  Observation base_;
  Surroundings rig_;
  std::optional<Retuning> retuning_;
};

}  // namespace

std::vector<Command> commands_of(const CaseSpec& spec, Realisation realisation) {
  DriveShape shape = spec.drive;
  if (realisation == Realisation::beyond) shape.rms *= 1.25;
  std::vector<Command> commands;
  for (std::size_t i = 0; i < spec.plan->inputs.size(); ++i) {
    Random random(spec.seed, Stream::road, spec.number, 16 * i + static_cast<std::uint64_t>(realisation));
    commands.push_back(make_command(shape, random));
  }
  return commands;
}

Prepared prepare(const CaseSpec& spec) {
  try {
    return Preparation(spec).run();
  } catch (const RigFailure& failure) {
    Prepared prepared;
    prepared.spec = spec;
    prepared.unreachable = std::string("the plant does not stand this drive: ") + failure.what();
    return prepared;
  }
}

}  // namespace wheelhop::blind

#include "experiments/experiment/study.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "core/data/metrics.hpp"
#include "core/identify/initial_state.hpp"

namespace wheelhop {
namespace {

template <class Piece>
Made<Piece> read_piece(const JsonCursor& config, const char* family, const std::vector<Entry<Piece>>& table,
                       const Made<Piece>* base, const char* fallback) {
  if (const auto member = config.find(family)) return make_from(table, *member);
  if (base) return *base;
  Json named = Json::object();
  named["name"] = fallback;
  return make_from(table, JsonCursor::from(std::move(named), std::string("default ") + family));
}

constexpr const char* kNoMap = "none";

/// Polynomials of one direction from the piece of that name; empty for "none".
RidgeFactory ridge_factory(const std::string& name) {
  if (name == kNoMap) return {};
  return [name](Index inputs, const RidgeForm& form) {
    Json options = {{"name", name}, {"degree", form.degree}, {"odd", form.odd}, {"hardening", form.hardening}};
    return make_from(nonlinearity_table(), JsonCursor::from(std::move(options), "alternative map")).piece(inputs, 1);
  };
}

/// The pieces that can be an alternative map: those with the options that ridge_factory() sets.
std::vector<std::string> alternative_maps() {
  std::vector<std::string> names = {kNoMap};
  for (const Entry<MapFactory>& entry : nonlinearity_table()) {
    std::size_t found = 0;
    for (const OptionInfo& option : entry.options())
      found += option.name == "degree" || option.name == "odd" || option.name == "hardening";
    if (found == 3) names.push_back(entry.name);
  }
  return names;
}

}  // namespace

Pieces PieceSet::borrowed(const PipelineOptions& options) const {
  return {*subspace.piece, *inversion.piece, nonlinearity.piece, *solver.piece, ridge_factory(options.alternative_map)};
}

Json PieceSet::config() const {
  return {{"subspace", subspace.config},
          {"inversion", inversion.config},
          {"nonlinearity", nonlinearity.config},
          {"solver", solver.config}};
}

PieceSet read_pieces(const JsonCursor& config, const PieceSet* base) {
  return {read_piece(config, "subspace", subspace_table(), base ? &base->subspace : nullptr, "pi_moesp"),
          read_piece(config, "inversion", inversion_table(), base ? &base->inversion : nullptr, "sdi"),
          read_piece(config, "nonlinearity", nonlinearity_table(), base ? &base->nonlinearity : nullptr, "mlp"),
          read_piece(config, "solver", solver_table(), base ? &base->solver : nullptr, "levenberg_marquardt")};
}

PipelineOptions read_pipeline(const JsonCursor& config, PipelineOptions defaults) {
  const auto member = config.find("pipeline");
  if (!member) return defaults;
  PipelineOptions options = read_options(*member, std::move(defaults));
  if (const auto name = member->find("alternative_map")) name->one_of(alternative_maps());
  member->done();
  return options;
}

Json to_json(const Refinements& refinement) {
  return {{"status", std::string(to_string(refinement.solution.status))},
          {"message", refinement.solution.message},
          {"iterations", refinement.solution.iterations},
          {"cost", refinement.solution.cost},
          {"round_costs", refinement.round_costs}};
}

ScoredRun run_and_score(const NonlinearModel& model, const Scaling& scaling, const Signal& signal,
                        ConstMatrixRef reference, Index initial_state_samples) {
  const Matrix u = scaling.u.cwiseInverse().asDiagonal() * signal.u;
  const Matrix y = scaling.y.cwiseInverse().asDiagonal() * signal.y;
  const Vector x0 = estimate_initial_state(model, u, y, initial_state_samples);
  FreeRun run = free_run(model, u, x0);
  ScoredRun result;
  result.status = run.status;
  result.x = std::move(run.x);
  result.f = std::move(run.f);
  result.y = scaling.y.asDiagonal() * run.y;
  result.vaf = Vector::Constant(reference.rows(), -std::numeric_limits<double>::infinity());
  if (run.status != Status::ok)
    result.message = fmt::format("the free run left the state guard at {:g} s",
                                 static_cast<double>(run.stopped_at) * signal.sample_time_s);
  else if (!all_finite(result.y))
    result.status = Status::not_finite;
  else
    result.vaf = vaf_percent(reference, result.y, signal.skip);
  return result;
}

}  // namespace wheelhop

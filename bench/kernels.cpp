// The timed pieces of the identification and of the diagnosis on seeded data of the sizes that real records have.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "core/base/random.hpp"
#include "core/data/csv.hpp"
#include "core/identify/free_run_problem.hpp"
#include "core/kernels/dare.hpp"
#include "core/kernels/hankel.hpp"
#include "variants/nonlinearity/mlp.hpp"

namespace {

using namespace wheelhop;

/// A random matrix of spectral radius 0.95.
Matrix stable_matrix(Index n, Random& random) {
  const Matrix A = random.normal(n, n);
  return 0.95 / spectral_radius(A) * A;
}

void hankel(benchmark::State& state) {
  Random random(1, Stream::noise);
  const Index samples = state.range(0), s = state.range(1);
  const Matrix u = random.normal(1, samples), y = random.normal(3, samples);
  for (auto _ : state) benchmark::DoNotOptimize(hankel_rq(u, y, s, s).R.data());
  state.SetItemsProcessed(state.iterations() * samples);
}
BENCHMARK(hankel)->ArgNames({"N", "s"})->ArgsProduct({{2000, 12000, 50000}, {10, 30}})->Unit(benchmark::kMillisecond);

void csv(benchmark::State& state) {
  Random random(1, Stream::noise);
  std::string text = "t,u,y\n";
  for (Index k = 0; k < state.range(0); ++k)
    text += fmt::format("{},{:.6},{:.6}\n", static_cast<double>(k) / 610.3515625, random.normal(), random.normal());
  for (auto _ : state) benchmark::DoNotOptimize(parse_csv(text, "records.csv").columns.data());
  state.SetBytesProcessed(state.iterations() * static_cast<Index>(text.size()));
}
BENCHMARK(csv)->ArgName("lines")->Arg(131072)->Unit(benchmark::kMillisecond);

void dare(benchmark::State& state) {
  Random random(2, Stream::noise);
  const Index n = state.range(0), p = 3;
  const Matrix A = stable_matrix(n, random), C = random.normal(p, n), G = random.normal(n, n);
  const Matrix Q = G * G.transpose(), R = Matrix::Identity(p, p);
  for (auto _ : state) benchmark::DoNotOptimize(solve_dare(A, C, Q, R).P.data());
}
BENCHMARK(dare)->ArgName("n")->Arg(5)->Arg(10)->Arg(20)->Arg(50)->Unit(benchmark::kMicrosecond);

void svd_of_r32(benchmark::State& state) {
  Random random(3, Stream::noise);
  const Index s = state.range(0);
  const Matrix u = random.normal(1, 12000), y = random.normal(3, 12000);
  const Matrix R32 = hankel_rq(u, y, s, s).R32();
  for (auto _ : state) benchmark::DoNotOptimize(svd(R32).s.data());
}
BENCHMARK(svd_of_r32)->ArgName("s")->Arg(10)->Arg(30)->Arg(60)->Unit(benchmark::kMicrosecond);

/// Cost, gradient and Gauss-Newton matrix of the joint refinement at one point: n = 4, m = q = 1, p = 3, five units.
void free_run_linearisation(benchmark::State& state) {
  Random random(4, Stream::noise);
  const Index n = 4, m = 1, p = 3, q = 1, samples = state.range(0);
  NonlinearModel model{
      {stable_matrix(n, random), random.normal(n, m), random.normal(p, n), random.normal(p, m), Vector::Zero(p)},
      0.01 * random.normal(n, q),
      random.normal(p, q),
      nullptr};
  auto map = make_mlp(n + m, q, {.hidden_units = 5});
  map->initialise(random.normal(n + m, 50), random.normal(q, 50), random);
  map->W.setConstant(0.1);
  model.map = std::move(map);
  const Matrix u = random.normal(m, samples), y = random.normal(p, samples);
  const auto problem = free_run_problem(model, u, y, Vector::Ones(p), 0);
  const Vector theta = pack(model, Vector::Zero(n));
  double cost = 0;
  Vector gradient;
  Matrix gauss_newton;
  for (auto _ : state) {
    if (!problem->normal_equations(theta, cost, gradient, gauss_newton)) state.SkipWithError("the free run diverged");
    benchmark::DoNotOptimize(gauss_newton.data());
  }
  state.SetItemsProcessed(state.iterations() * samples);
}
BENCHMARK(free_run_linearisation)->ArgName("N")->Arg(2000)->Arg(12000)->Unit(benchmark::kMillisecond);

}  // namespace

// `wheelhop identify` without any option on drawn linear plants, as a study: how often it is at the noise, and how
// often its 90 % intervals hold the truth. Not run by ctest; by hand: test_program "[study]".
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <cstdio>

#include "core/base/json.hpp"
#include "core/data/metrics.hpp"
#include "core/data/table.hpp"
#include "tests/support/drawn_plants.hpp"
#include "tests/support/program.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

struct Count {
  int held = 0, all = 0;
  void add(bool holds) {
    held += holds;
    ++all;
  }
  double share() const { return all > 0 ? static_cast<double>(held) / all : 0; }
};

Table table_of(double hz, const Matrix& u, const Matrix& y) {
  Table table;
  table.names = {"t"};
  for (Index i = 0; i < u.rows(); ++i) table.names.push_back("u" + std::to_string(i));
  for (Index i = 0; i < y.rows(); ++i) table.names.push_back("y" + std::to_string(i));
  table.columns.resize(1 + u.rows() + y.rows(), u.cols());
  table.columns << Vector::LinSpaced(u.cols(), 0, static_cast<double>(u.cols() - 1) / hz).transpose(), u, y;
  return table;
}

bool inside(const Json& interval, double value) {
  return interval.at(0).get<double>() <= value && value <= interval.at(1).get<double>();
}

void count_poles(const Json& found, const LinearModel& truth, double hz, Count& count) {
  for (const Json& own : found) {
    const std::complex<double> pole(own.at("pole").at(0).get<double>(), own.at("pole").at(1).get<double>());
    std::complex<double> nearest = 0;
    for (const std::complex<double>& other : eigenvalues(truth.A))
      if (std::abs(other - pole) < std::abs(nearest - pole)) nearest = other;
    const std::complex<double> lambda = std::log(nearest);
    count.add(inside(own.at("frequency_interval_hz"), std::abs(lambda) * hz / (2 * 3.14159265358979323846)));
    if (pole.imag() > 0) count.add(inside(own.at("damping_interval"), -lambda.real() / std::abs(lambda)));
  }
}

void count_responses(const Json& uncertainty, const DelayedPlant& plant, double hz, Count& count) {
  const Index n = plant.model.order();
  const Json& frequencies = uncertainty.at("frequency_hz");
  for (std::size_t k = 0; k < frequencies.size(); k += 4) {
    const double w = 2 * 3.14159265358979323846 * frequencies[k].get<double>() / hz;
    const Eigen::MatrixXcd M = std::polar(1.0, w) * Eigen::MatrixXcd::Identity(n, n) - plant.model.A;
    Eigen::MatrixXcd truth = plant.model.C * M.inverse() * plant.model.B;
    for (std::size_t i = 0; i < plant.delay.size(); ++i)
      truth.col(static_cast<Index>(i)) *= std::polar(1.0, -w * static_cast<double>(plant.delay[i]));
    const Json& pairs = uncertainty.at("frequency_response_at_rest");
    for (std::size_t e = 0; e < pairs.size(); ++e) {
      const auto inputs = plant.delay.size();
      const double value = std::abs(truth(static_cast<Index>(e / inputs), static_cast<Index>(e % inputs)));
      count.add(pairs[e].at("magnitude_low")[k].get<double>() <= value &&
                value <= pairs[e].at("magnitude_high")[k].get<double>());
    }
  }
}

}  // namespace

TEST_CASE("drawn linear plants", "[.study]") {
  constexpr int draws = 60;
  Count at_noise, orders, poles, responses;
  for (int draw = 0; draw < draws; ++draw) {
    Random random = numbers(4000 + static_cast<std::uint64_t>(draw));
    const double period = 5 * std::pow(40.0, random.uniform()), fastest_hz = 0.5 * std::pow(10.0, random.uniform());
    const double hz = std::round(fastest_hz * period * 100) / 100, seconds = 10 + 50 * random.uniform();
    const Index N = std::min<Index>(static_cast<Index>(hz * seconds), 40000);
    const PlantDraw wanted{.pairs = 1 + random.integer(4),
                           .inputs = 1 + random.integer(3),
                           .outputs = 1 + random.integer(3),
                           .period = period,
                           .longest_delay = 20};
    const DelayedPlant plant = drawn_plant(wanted, random);
    const double noise = std::pow(10.0, -1 - 2 * random.uniform());
    const Folder folder;
    Vector scale;
    Json records = {{"sampling_hz", hz}, {"records", Json::array()}};
    for (const char* role : {"estimation", "validation"}) {
      const Matrix u = random.normal(wanted.inputs, N);
      Matrix y = respond(plant, u);
      if (scale.size() == 0) scale = rms(y);
      y += noise * scale.asDiagonal() * random.normal(wanted.outputs, N);
      write_table(folder / (std::string(role) + ".csv"), table_of(hz, u, y));
      records["records"].push_back({{"file", std::string(role) + ".csv"}, {"role", role}});
    }
    Json config = {{"inputs", Json::array()}, {"outputs", Json::array()}};
    for (Index i = 0; i < wanted.inputs; ++i) config["inputs"].push_back({{"name", "u" + std::to_string(i)}});
    for (Index i = 0; i < wanted.outputs; ++i) config["outputs"].push_back({{"name", "y" + std::to_string(i)}});
    write_json(folder / "records.json", records);
    write_json(folder / "config.json", config);
    const Said said =
        run_program("identify '" + (folder / "config.json").string() + "' --quiet --records '" +
                    (folder / "records.json").string() + "' --out '" + (folder / "model.json").string() + "'");
    std::printf("%d: order %td, %td in, %td out, %td samples, period %.1f, noise %.4f: ", draw, plant.model.order(),
                wanted.inputs, wanted.outputs, N, period, noise);
    if (said.status != 0) {
      std::printf("no model: %s", (said.err + said.out).c_str());
      continue;
    }
    const Json model = parse_json(read_file(folder / "model.json"), "model.json");
    const Json& rmse = model.at("scores").at("records").at(1).at("rmse");
    double worst = 0;
    for (Index i = 0; i < wanted.outputs; ++i)
      worst = std::max(worst, rmse.at("y" + std::to_string(i)).get<double>() / (noise * scale(i)));
    at_noise.add(worst <= 1.1);
    const bool same_order = model.at("order") == plant.model.order();
    orders.add(same_order);
    const Json& uncertainty = model.at("uncertainty");
    std::printf("error %.3f of the noise, order %td%s\n", worst, model.at("order").get<Index>(),
                worst > 1.1 ? (" *** " + model.at("message").get<std::string>()).c_str() : "");
    if (uncertainty.is_null()) continue;
    if (same_order) count_poles(uncertainty.at("poles_at_rest"), plant.model, hz, poles);
    if (worst <= 1.1) count_responses(uncertainty, plant, hz, responses);
  }
  std::printf("at the noise %d of %d, order %d; intervals hold %.3f of %d poles, %.3f of %d responses\n", at_noise.held,
              draws, orders.held, poles.share(), poles.all, responses.share(), responses.all);
  CHECK(at_noise.held >= static_cast<int>(0.975 * draws));
  CHECK(poles.share() > 0.85);
  CHECK(poles.share() < 0.95);
  CHECK(responses.share() > 0.85);
  CHECK(responses.share() < 0.95);
}

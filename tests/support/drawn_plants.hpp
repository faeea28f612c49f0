/// \file
/// Drawn linear plants of pairs of poles whose inputs act late.
#pragma once

#include <cmath>
#include <vector>

#include "tests/support/systems.hpp"

namespace wheelhop::test {

struct DelayedPlant {
  LinearModel model;
  std::vector<Index> delay;
};

struct PlantDraw {
  Index pairs = 1, inputs = 1, outputs = 1;
  double period = 20;         ///< samples, of the fastest mode; the others up to five times slower
  double most_damping = 0.5;  ///< ratio, from 0.02 on
  Index longest_delay = 0;    ///< samples
};

inline DelayedPlant drawn_plant(const PlantDraw& wanted, Random& random) {
  const Index n = 2 * wanted.pairs;
  DelayedPlant plant;
  plant.model.A = Matrix::Zero(n, n);
  plant.model.B = random.normal(n, wanted.inputs);
  plant.model.C = random.normal(wanted.outputs, n);
  plant.model.D = Matrix::Zero(wanted.outputs, wanted.inputs);
  plant.model.y0 = Vector::Zero(wanted.outputs);
  for (Index i = 0; i < wanted.pairs; ++i) {
    const double slower = i == 0 ? 1 : std::pow(5.0, random.uniform());
    const double w = 2 * 3.14159265358979323846 / (wanted.period * slower);
    const double damping = 0.02 * std::pow(wanted.most_damping / 0.02, random.uniform());
    const std::complex<double> pole = std::polar(std::exp(-damping * w), w * std::sqrt(1 - damping * damping));
    plant.model.A.block(2 * i, 2 * i, 2, 2) << pole.real(), pole.imag(), -pole.imag(), pole.real();
    plant.model.B.middleRows(2 * i, 2) *= std::sqrt(damping * w);  // modes of similar size in the outputs
  }
  for (Index i = 0; i < wanted.inputs; ++i) plant.delay.push_back(random.integer(wanted.longest_delay + 1));
  return plant;
}

/// From rest; before the record the inputs are zero.
inline Matrix respond(const DelayedPlant& plant, ConstMatrixRef u) {
  Matrix late = Matrix::Zero(u.rows(), u.cols());
  for (Index i = 0; i < u.rows(); ++i) {
    const Index d = plant.delay[static_cast<std::size_t>(i)];
    late.row(i).rightCols(u.cols() - d) = u.row(i).leftCols(u.cols() - d);
  }
  return simulate(plant.model, late, Vector::Zero(plant.model.order())).y;
}

}  // namespace wheelhop::test

#include "core/model/static_map.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace wheelhop {
namespace {

Vector vector_of(const JsonCursor& cursor, Index size) {
  const std::vector<double> values = cursor.numbers();
  if (static_cast<Index>(values.size()) != size)
    cursor.fail(fmt::format("{} numbers, as the options, the order and the channels ask for", size));
  return Eigen::Map<const Vector>(values.data(), size);
}

Matrix matrix_of(const JsonCursor& cursor, Index rows, Index columns) {
  Matrix values = matrix_from_json(cursor);
  if (values.rows() != rows || values.cols() != columns) cursor.fail(fmt::format("a matrix of {} x {}", rows, columns));
  return values;
}

}  // namespace

Json StaticMap::to_json() const {
  return {{"name", name()},
          {"options", options()},
          {"alpha", std::vector<double>(alpha.begin(), alpha.end())},
          {"W", wheelhop::to_json(W)},
          {"b", std::vector<double>(b.begin(), b.end())},
          {"L", wheelhop::to_json(L)}};
}

void StaticMap::read_parameters(const JsonCursor& cursor) {
  alpha = vector_of(cursor.at("alpha"), alpha.size());
  W = matrix_of(cursor.at("W"), W.rows(), W.cols());
  L = matrix_of(cursor.at("L"), L.rows(), L.cols());
  b = vector_of(cursor.at("b"), b.size());
}

Vector StaticMap::theta() const {
  Vector all(parameters());
  all << alpha, W.reshaped(), b;
  return all;
}

void StaticMap::set_theta(ConstVectorRef theta) {
  if (theta.size() != parameters()) throw std::invalid_argument("StaticMap::set_theta: wrong number of parameters");
  alpha = theta.head(alpha.size());
  W.reshaped() = theta.segment(alpha.size(), W.size());
  b = theta.tail(b.size());
}

Matrix StaticMap::basis_of(ConstMatrixRef xi) const {
  Matrix phi(features(), xi.cols());
  for (Index k = 0; k < xi.cols(); ++k) basis(xi.col(k).data(), phi.col(k).data());
  return phi.transpose();
}

Matrix StaticMap::alpha_slopes(ConstMatrixRef xi, ConstMatrixRef phi, ConstVectorRef w) const {
  Matrix slopes_of_point(inner_parameters(), xi.cols());
  Vector here(features()), weights = w, dxi(inputs());
  for (Index k = 0; k < xi.cols(); ++k) {
    here = phi.row(k);
    slopes(xi.col(k).data(), here.data(), weights.data(), dxi.data(), slopes_of_point.col(k).data());
  }
  return slopes_of_point.transpose();
}

void StaticMap::value(const double* xi, double* f, double* phi_scratch) const {
  basis(xi, phi_scratch);
  for (Index i = 0; i < outputs(); ++i) {
    double sum = b(i);
    for (Index j = 0; j < features(); ++j) sum += W(i, j) * phi_scratch[j];
    for (Index j = 0; j < inputs_; ++j) sum += L(i, j) * xi[j];
    f[i] = sum;
  }
}

}  // namespace wheelhop

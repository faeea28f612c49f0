#include "variants/nonlinearity/polynomial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/status.hpp"

namespace wheelhop {
namespace {

constexpr double kMostTerms = 5000;  // judgement: a fit by least squares then takes half a minute

/// Exponents of every term, d values each, by ascending total degree.
std::vector<Index> exponents(Index inputs, const PolynomialOptions& options) {
  std::vector<Index> all, term(static_cast<std::size_t>(inputs));
  for (Index total = 2; total <= options.degree; ++total) {
    if (options.odd && total % 2 == 0) continue;
    const auto spread = [&](auto&& self, Index j, Index left) -> void {
      if (j == inputs - 1) {
        term[static_cast<std::size_t>(j)] = left;
        all.insert(all.end(), term.begin(), term.end());
        return;
      }
      for (Index power = left; power >= 0; --power) {
        term[static_cast<std::size_t>(j)] = power;
        self(self, j + 1, left - power);
      }
    };
    spread(spread, 0, total);
  }
  return all;
}

class Polynomial final : public StaticMap {
 public:
  Polynomial(Index inputs, Index outputs, const PolynomialOptions& options)
      : StaticMap(inputs, outputs, static_cast<Index>(polynomial_terms(inputs, options)), 0),
        options_(options),
        exponents_(exponents(inputs, options)) {}

  std::unique_ptr<StaticMap> clone() const override { return std::make_unique<Polynomial>(*this); }
  std::string name() const override { return "polynomial"; }
  void initialise(ConstMatrixRef /*xi*/, ConstMatrixRef /*f*/, Random& /*random*/) override {}

  void basis(const double* xi, double* phi) const override {
    const Matrix powers = hermite(xi);
    const Index d = inputs();
    for (Index i = 0; i < features(); ++i) {
      double product = 1;
      for (Index j = 0; j < d; ++j) product *= powers(exponent(i, j), j);
      phi[i] = product;
    }
  }

  void slopes(const double* xi, const double* /*phi*/, const double* w, double* dxi,
              double* /*dalpha*/) const override {
    const Matrix powers = hermite(xi);
    const Index d = inputs();
    std::fill(dxi, dxi + d, 0.0);
    for (Index i = 0; i < features(); ++i)
      for (Index j = 0; j < d; ++j) {
        const Index own = exponent(i, j);
        if (own == 0) continue;
        double product = w[i] * std::sqrt(static_cast<double>(own)) * powers(own - 1, j);
        for (Index l = 0; l < d; ++l)
          if (l != j) product *= powers(exponent(i, l), l);
        dxi[j] += product;
      }
  }

  Matrix basis_of(ConstMatrixRef xi) const override {
    const Index d = inputs(), N = xi.cols();
    std::vector<Matrix> powers(static_cast<std::size_t>(d), Matrix(N, options_.degree + 1));
    for (Index k = 0; k < N; ++k) {
      const Matrix here = hermite(xi.col(k).data());
      for (Index j = 0; j < d; ++j) powers[static_cast<std::size_t>(j)].row(k) = here.col(j).transpose();
    }
    Matrix phi = Matrix::Ones(N, features());
    for (Index i = 0; i < features(); ++i)
      for (Index j = 0; j < d; ++j)
        if (exponent(i, j) > 0) phi.col(i).array() *= powers[static_cast<std::size_t>(j)].col(exponent(i, j)).array();
    return phi;
  }

 private:
  Json options() const override { return write_options(options_); }

  Index exponent(Index term, Index input) const {
    return exponents_[static_cast<std::size_t>(term * inputs() + input)];
  }

  /// He_a(xi_j) / sqrt(a!) at (a, j), by h_(a+1) = (x h_a - sqrt(a) h_(a-1)) / sqrt(a + 1).
  Matrix hermite(const double* xi) const {
    Matrix h(options_.degree + 1, inputs());
    for (Index j = 0; j < inputs(); ++j) {
      h(0, j) = 1;
      h(1, j) = xi[j];
      for (Index a = 1; a < options_.degree; ++a)
        h(a + 1, j) =
            (xi[j] * h(a, j) - std::sqrt(static_cast<double>(a)) * h(a - 1, j)) / std::sqrt(static_cast<double>(a + 1));
    }
    return h;
  }

  PolynomialOptions options_;
  std::vector<Index> exponents_;
};

}  // namespace

double polynomial_terms(Index inputs, const PolynomialOptions& options) {
  double terms = 0, of_degree = static_cast<double>(inputs);  // C(d + total - 1, total)
  for (Index total = 2; total <= options.degree; ++total) {
    of_degree *= static_cast<double>(inputs + total - 1) / static_cast<double>(total);
    if (!options.odd || total % 2 == 1) terms += std::round(of_degree);
  }
  return terms;
}

std::unique_ptr<StaticMap> make_polynomial(Index inputs, Index outputs, const PolynomialOptions& options) {
  if (const double terms = polynomial_terms(inputs, options); !(terms <= kMostTerms))
    throw UserError(
        fmt::format("polynomial: degree {} of {} inputs (order and inputs of the model) has {:.0f} terms, "
                    "more than {:.0f}; lower the degree",
                    options.degree, inputs, terms, kMostTerms));
  if (options.odd && options.degree < 3)
    throw UserError("polynomial: odd terms begin with degree 3, found degree 2; raise the degree or set odd to false");
  return std::make_unique<Polynomial>(inputs, outputs, options);
}

}  // namespace wheelhop

#include "variants/table.hpp"
#include "variants/extra.hpp"
#include "variants/nonlinearity/mlp.hpp"
#include "variants/nonlinearity/polynomial.hpp"
#include "variants/nonlinearity/rbf.hpp"
#include "variants/nonlinearity/ridge_polynomial.hpp"

namespace wheelhop {
namespace {

/// make_piece of a map: the sizes are known only once the order is.
template <class Options, auto make_map>
MapFactory factory(const Options& options) {
  return [options](Index inputs, Index outputs) { return make_map(inputs, outputs, options); };
}

}  // namespace

const std::vector<Entry<MapFactory>>& nonlinearity_table() {
  static const std::vector<Entry<MapFactory>> table = with_extra(
      {table_entry<MapFactory, MlpOptions, factory<MlpOptions, make_mlp>>(
           "mlp", "feed-forward sigmoidal network of Sec. 2.6; Sjoberg & Viberg 1997",
           "one hidden layer of tanh units, linear output"),
       table_entry<MapFactory, RidgePolynomialOptions, factory<RidgePolynomialOptions, make_ridge_polynomial>>(
           "ridge_polynomial", "ridge function of projection pursuit: Friedman & Stuetzle 1981",
           "polynomial of one direction; the refinement tries it in place of any other map"),
       table_entry<MapFactory, RbfOptions, factory<RbfOptions, make_rbf>>(
           "rbf", "Broomhead & Lowe 1988; k-means: MacQueen 1967",
           "Gaussian units of learned directions; flat beyond the training record"),
       table_entry<MapFactory, PolynomialOptions, factory<PolynomialOptions, make_polynomial>>(
           "polynomial", "PNLSS: Paduart et al. 2010",
           "full multivariate polynomial of a total degree; linear in its weights, grows fast beyond the training "
           "record")},
      extra_pieces().nonlinearity);
  return table;
}

std::unique_ptr<StaticMap> restore_map(const JsonCursor& cursor, Index inputs, Index outputs) {
  const Entry<MapFactory>& entry = find_entry(nonlinearity_table(), cursor);
  // The table reads an option and its name from one object; a model file keeps them apart.
  Json options = cursor.at("options").raw();
  if (!options.is_object()) cursor.at("options").fail("an object");
  options["name"] = entry.name;
  std::unique_ptr<StaticMap> map =
      entry.make(JsonCursor::from(std::move(options), cursor.where() + ".options")).piece(inputs, outputs);
  map->read_parameters(cursor);
  cursor.done();
  return map;
}

}  // namespace wheelhop

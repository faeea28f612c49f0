#include <fmt/format.h>

#include "variants/nonlinearity/mlp.hpp"
#include "variants/nonlinearity/ridge_polynomial.hpp"
#include "variants/table.hpp"

namespace wheelhop {
namespace {

/// make_piece of a map: the sizes are known only once the order is.
template <class Options, auto make_map>
MapFactory factory(const Options& options) {
  return [options](Index inputs, Index outputs) { return make_map(inputs, outputs, options); };
}

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

const std::vector<Entry<MapFactory>>& nonlinearity_table() {
  static const std::vector<Entry<MapFactory>> table = {
      table_entry<MapFactory, MlpOptions, factory<MlpOptions, make_mlp>>(
          "mlp", "feed-forward sigmoidal network of Sec. 2.6; Sjoberg & Viberg 1997",
          "one hidden layer of tanh units, linear output"),
      table_entry<MapFactory, RidgePolynomialOptions, factory<RidgePolynomialOptions, make_ridge_polynomial>>(
          "ridge_polynomial", "ridge function of projection pursuit: Friedman & Stuetzle 1981",
          "polynomial of one direction; the refinement tries it in place of any other map")};
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
  map->alpha = vector_of(cursor.at("alpha"), map->inner_parameters());
  map->W = matrix_of(cursor.at("W"), map->W.rows(), map->W.cols());
  map->L = matrix_of(cursor.at("L"), map->L.rows(), map->L.cols());
  map->b = vector_of(cursor.at("b"), outputs);
  cursor.done();
  return map;
}

}  // namespace wheelhop

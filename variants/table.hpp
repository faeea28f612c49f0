/// \file
/// The tables of swappable pieces, one a family: what exists, where it comes from, how it is made from a config. A
/// piece is chosen by an object `{"name": NAME, OPTION: value, ...}`.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/options.hpp"
#include "core/gap/which/effect.hpp"
#include "core/identify/pieces.hpp"
#include "core/model/static_map.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

/// A piece and its effective options, `{"name": ..., OPTION: value, ...}` with every default filled in.
template <class Piece>
struct Made {
  Piece piece;
  Json config;
};

/// One line of a family's table.
template <class Piece>
struct Entry {
  std::string name;
  std::string source;   ///< authors, year, equation
  std::string meaning;  ///< what it does, in one line
  Made<Piece> (*make)(const JsonCursor& options);
  std::vector<OptionInfo> (*options)();
  std::string (*unavailable)();  ///< why it cannot be used in this build; empty where it can
};

using SubspacePiece = std::shared_ptr<const SubspaceEstimator>;
using InversionPiece = std::shared_ptr<const InputReconstructor>;
using EffectPiece = std::shared_ptr<const Effect>;
using SolverPiece = std::shared_ptr<const Solver>;
/// Makes an untrained map R^inputs -> R^outputs.
using MapFactory = std::function<std::unique_ptr<StaticMap>(Index inputs, Index outputs)>;

const std::vector<Entry<SubspacePiece>>& subspace_table();
const std::vector<Entry<InversionPiece>>& inversion_table();
const std::vector<Entry<MapFactory>>& nonlinearity_table();
const std::vector<Entry<SolverPiece>>& solver_table();
const std::vector<Entry<EffectPiece>>& effect_table();
/// Every candidate of every effect family on a plant, in the order of the table.
std::vector<EffectCandidate> effect_candidates(const Plant& plant, const Operation& operation);

/// A trained map from a model file: `{"name", "options", "alpha", "W", "b", "L"}`, as StaticMap::to_json writes it.
/// UserError for an unknown name or option and for parameters that do not fit the options.
/// @param inputs d = n + m   @param outputs q
std::unique_ptr<StaticMap> restore_map(const JsonCursor& cursor, Index inputs, Index outputs);

/// What `list` shows of a piece; the same for every family.
struct PieceInfo {
  std::string name, source, meaning, unavailable;
  std::vector<OptionInfo> options;
};
struct Family {
  std::string name;     ///< folder under variants/ and key in a config
  std::string meaning;  ///< what the family's pieces are for
  std::vector<PieceInfo> pieces;
};
/// Every family, in the order in which the pipeline uses them.
std::vector<Family> families();

inline std::string always_available() { return ""; }

/// An entry whose piece is made by `make_piece(options)` from an Options struct (see core/base/options.hpp).
/// @param unavailable why this build cannot use it; see Entry
template <class Piece, class Options, auto make_piece>
Entry<Piece> table_entry(std::string name, std::string source, std::string meaning,
                         std::string (*unavailable)() = always_available) {
  // Captureless functions must know the name without the entry: the config carries it.
  return {std::move(name),
          std::move(source),
          std::move(meaning),
          [](const JsonCursor& cursor) -> Made<Piece> {
            const Options options = read_options<Options>(cursor);
            Json config = {{"name", cursor.string("name", "")}};
            cursor.done();
            config.update(write_options(options));
            return {make_piece(options), std::move(config)};
          },
          [] { return describe_options<Options>(); },
          unavailable};
}

/// The entry called `cursor.at("name")`. UserError naming the known names (and the nearest) for an unknown one, and the
/// reason for one that this build lacks.
template <class Piece>
const Entry<Piece>& find_entry(const std::vector<Entry<Piece>>& table, const JsonCursor& cursor) {
  std::vector<std::string> names;
  for (const Entry<Piece>& entry : table) names.push_back(entry.name);
  const std::string name = cursor.at("name").one_of(names);
  for (const Entry<Piece>& entry : table) {
    if (entry.name != name) continue;
    if (const std::string reason = entry.unavailable(); !reason.empty())
      throw UserError(cursor.where() + ".name: \"" + name + "\" is not available: " + reason);
    return entry;
  }
  cursor.fail("one of: " + join_names(names));
}

/// The piece that an object of a config asks for.
template <class Piece>
Made<Piece> make_from(const std::vector<Entry<Piece>>& table, const JsonCursor& cursor) {
  return find_entry(table, cursor).make(cursor);
}

}  // namespace wheelhop

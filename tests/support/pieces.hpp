/// \file
/// Every piece of a family that this build has, for tests that run over the tables.
#pragma once

#include <string>
#include <vector>

#include "variants/table.hpp"

namespace wheelhop::test {

template <class Piece>
struct Named {
  std::string name;
  Piece piece;
};

/// @param options set over the defaults of each piece
template <class Piece>
std::vector<Named<Piece>> pieces_of(const std::vector<Entry<Piece>>& table, const Json& options = Json::object()) {
  std::vector<Named<Piece>> all;
  for (const Entry<Piece>& entry : table) {
    if (!entry.unavailable().empty()) continue;
    Json config = {{"name", entry.name}};
    config.update(options);
    all.push_back({entry.name, entry.make(JsonCursor::from(std::move(config), "test.json")).piece});
  }
  if (all.empty()) throw std::logic_error("a family without pieces");
  return all;
}

}  // namespace wheelhop::test

#include "variants/table.hpp"

namespace wheelhop {
namespace {

template <class Piece>
Family family(std::string name, std::string meaning, const std::vector<Entry<Piece>>& table) {
  Family result{std::move(name), std::move(meaning), {}};
  for (const Entry<Piece>& entry : table)
    result.pieces.push_back({entry.name, entry.source, entry.meaning, entry.unavailable(), entry.options()});
  return result;
}

}  // namespace

std::vector<Family> families() {
  return {
      family("subspace", "step 1: linear model from input and output", subspace_table()),
      family("inversion", "step 3: auxiliary input from the linear residual", inversion_table()),
      family("nonlinearity", "step 4: static map from state and input to the auxiliary input", nonlinearity_table()),
      family("solver", "least-squares solver behind steps 2, 4, 5 and the joint refinement", solver_table()),
      family("effect", "what a plant may lack: the catalogue of the diagnosis", effect_table())};
}

}  // namespace wheelhop

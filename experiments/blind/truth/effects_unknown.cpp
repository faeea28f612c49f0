#include "experiments/blind/truth/effects.hpp"
namespace wheelhop::blind {
std::vector<EffectKind> unknown_kinds() { return {}; }
std::vector<EffectKind> parameter_kinds() { return {}; }
}

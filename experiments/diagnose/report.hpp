/// \file
/// The picture page of a diagnosis: what it shows beside the diagnosis file.
#pragma once

#include <filesystem>

#include "core/base/json.hpp"
#include "core/base/place.hpp"
#include "core/gap/diagnose.hpp"
#include "core/gap/study/examine.hpp"

namespace wheelhop {

/// The place whose unknown signal is worth a picture: the answer's, or what the catalogue-free search puts first. Empty
/// if there is neither, or no gap.
Place place_of_note(const Diagnosis& diagnosis);

/// The place whose ceilings stand beside the answer: the same, but of an answer in the time base that one. Empty if
/// there is no gap.
Place place_of_ceiling(const Diagnosis& diagnosis);

/// Time series and scatters (schema `wheelhop.diagnosis_figures/1`): measured and simulated over the second in which
/// the plant as delivered is worst, the gap over every working range, the unknown signal over travel and rate.
Json diagnosis_figures_json(const Plant& plant, const Examination& examination);

/// "D.json" -> "D.figures.json", where plots/render.mjs looks for them.
std::filesystem::path figures_beside(const std::filesystem::path& diagnosis);

}  // namespace wheelhop

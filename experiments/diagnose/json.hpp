/// \file
/// The diagnosis file: schema `wheelhop.diagnosis/1`.
#pragma once

#include <string>

#include "core/base/json.hpp"
#include "core/gap/diagnose.hpp"
#include "core/gap/study/examine.hpp"
#include "core/gap/study/placebo.hpp"
#include "experiments/diagnose/view.hpp"

namespace wheelhop {

/// Beside what the answer says, `where` holds what each place leaves without the catalogue (`without_catalogue`), how
/// many unknown signals it takes to explain all channels (`places_needed`: 1, 2, or 0, not locatable) and, unless one
/// does, what pairs of places leave (`two_places`); `left_with_answer` is the first of these lists once the effects
/// named are in the plant.
/// @param plant as delivered   @param examination null where there is none to be had (a diagnosis that failed)
/// @param view what of it is shown, the answer included   @param corrected name of the corrected plant's file
Json diagnosis_json(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination, const View& view,
                    const std::string& corrected);

/// {"runs", "same", "names": {name: runs that name it}}; {"absent": why} where nothing was simulated.
Json placebo_json(const Placebo& placebo);

}  // namespace wheelhop

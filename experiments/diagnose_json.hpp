/// \file
/// The diagnosis file: schema `wheelhop.diagnosis/1`.
#pragma once

#include <string>

#include "core/base/json.hpp"
#include "core/gap/diagnose.hpp"
#include "core/gap/examine.hpp"
#include "core/gap/placebo.hpp"

namespace wheelhop {

/// @param plant as delivered   @param examination null where there is none to be had (a diagnosis that failed)
/// @param answer the one sentence   @param corrected name of the corrected plant's file
Json diagnosis_json(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination,
                    const std::string& answer, const std::string& corrected);

/// {"runs", "same", "names": {name: runs that name it}}; {"absent": why} where nothing was simulated.
Json placebo_json(const Placebo& placebo);

}  // namespace wheelhop

/// \file
/// Inputs that are well formed and cannot mean what they say: refused with their place, before anything is computed.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/status.hpp"
#include "core/data/records.hpp"
#include "core/plant/plant.hpp"

namespace wheelhop {

/// The plant, if it has inputs, and every displacement input an element at it: one without could move nothing.
/// UserError "WHERE.inputs[0]: ..." otherwise. @param where file and JSON path of the plant
Plant require_acting_inputs(Plant plant, const std::string& where);

/// A plant file, with that check. Of a rig that was left to itself, as in a free decay, it may have no inputs.
Plant load_plant_of_records(const std::filesystem::path& file);
/// The same, of a plant that is driven.
Plant load_acting_plant(const std::filesystem::path& file);

/// A record set that can be computed with. UserError with file and JSON path for
/// - a channel whose squares add up to infinity, or to nothing though it is not zero;
/// - a `noise_std` whose square is no number > 0, or below the last digit of the channel it belongs to (2^-52 of its
///   RMS).
void require_sound_records(const RecordSet& set, const std::filesystem::path& file);

/// UserError with file and JSON path if the plant's drives are not held a whole number of times in a sample.
void require_hold_rate(const Plant& plant, const RecordSet& set, const std::filesystem::path& file);

/// What is thrown where records do not carry a computation, with file and JSON path before it.
UserError placed_in_records(const UserError& error, const RecordSet& set, const std::filesystem::path& file);

/// The result of work(), whose UserErrors tell of the records in `file`.
template <class Work>
auto at_records(const RecordSet& set, const std::filesystem::path& file, Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const MachineError&) {
    throw;
  } catch (const UserError& error) {
    throw placed_in_records(error, set, file);
  }
}

/// UserError with file and JSON path if a record for validation holds samples that are fitted: the same samples of a
/// file, under any name, or the same numbers.
void require_held_out(const RecordSet& set, const std::filesystem::path& file);

}  // namespace wheelhop

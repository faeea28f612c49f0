/// \file
/// From a drive to a record as a measuring system would see it, and from a record back to a simulation. Both go through
/// the drive paths and sensor paths of the plant (paths.hpp); `simulate` itself knows neither, and the `u` of a record
/// is the command.
#pragma once

#include <string>
#include <vector>

#include "core/plant/simulate.hpp"
#include "core/plant/tangent.hpp"

namespace wheelhop {

struct GeneratedRecord {
  Status status = Status::ok;
  std::string message;
  Signal signal;  ///< noise-free; whole only if the status is ok
  Matrix states;  ///< (2n + s) x N at the record's samples, as those of `simulate`
};

/// Number of hold intervals in one sample of a record. UserError naming both rates unless it is a whole number >= 1.
Index hold_samples_per_record_sample(const Plant& plant, double sampling_hz);

/// `simulate` through the drive paths and sensor paths: what fits and predictions compare with a record.
/// @param drive m x N commands at the hold rate   @param options `decimation` as in `simulate`: hold samples a record
/// sample. Statuses as `simulate`.
Simulation simulate_measured(const Plant& plant, ConstMatrixRef drive, SimulateOptions options = {});

/// The same for several drives and plants at once, four in a vector register where `simulate_side_by_side` can.
/// @param tasks with commands as drives
std::vector<Simulation> simulate_measured_side_by_side(const std::vector<SimulationTask>& tasks);

/// A simulation through the paths, and how what it reads changes in given directions.
struct VariedSimulation {
  Simulation simulation;        ///< as `simulate_measured`
  std::vector<Matrix> outputs;  ///< p x K a variation, per unit of its step; whole only if the status is ok
  std::vector<char> defined;    ///< false of a variation whose neighbour left the domain of its laws
};
/// @param variations in the order that `Tangent` expects; `drive` and `sampled` are set here, from the paths of the
/// neighbours. Sensors may not round (`unquantised`): a lattice has no slope. Statuses as `simulate`.
/// Cost: of `simulate_measured`, and of a `Tangent`; the drive paths once more a neighbour with other ones.
VariedSimulation simulate_varied(const Plant& plant, ConstMatrixRef drive, SimulateOptions options,
                                 std::vector<Variation> variations);

/// Simulates a drive and keeps every sample of the record: u and y are picked at the record's instants, not filtered
/// (an anti-alias filter would smear a static nonlinearity in time; the outputs of a plant under a road of 10 Hz hold
/// 4e-11 of their power above 100 Hz).
/// @param drive m x (lead + N * ratio) at the hold rate   @param sampling_hz divides the hold rate
/// @param options `decimation` is set here. Statuses as `simulate`.
GeneratedRecord generate_record(const Plant& plant, ConstMatrixRef drive, double sampling_hz,
                                SimulateOptions options = {});

/// Share of its range by which a measured schedule may lie beyond either end and count as that end: a judgement, for
/// what noise and an offset of a few per cent do there.
inline constexpr double kBeyondSchedule = 0.05;

/// Rows of `channels` put into the order of the plant's inputs, found by name. UserError naming missing inputs and the
/// known channels, a unit that differs from the plant's (an empty unit is taken as the plant's), or a schedule that
/// leaves its range.
Matrix drive_of_record(const Plant& plant, const Signal& record);

/// Simulates the plant under the inputs of a record: finds them by name, brings each to the hold rate by its own
/// `interpolation`, simulates, and keeps the record's instants.
/// @param record u at sample_time_s; its outputs are not read
/// @param options from the equilibrium of the first sample unless told otherwise; `decimation` is set here;
///        `lead_samples`: the first drive sample is held over so many hold intervals before the record starts
/// @return signal with the record's u and the plant's outputs, `skip` kept. Statuses as `simulate`.
GeneratedRecord simulate_record(const Plant& plant, const Signal& record,
                                SimulateOptions options = {.from_equilibrium = true});

}  // namespace wheelhop

/// \file
/// The menu of a planned test: what else could be run or measured, made from the planned drives and the plant alone.
#pragma once

#include <string>
#include <vector>

#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// Another drive, or the planned one on a plant under a static load.
struct MenuDrive {
  std::string name;                ///< "at 1.5 x the level"
  std::vector<FitRecord> records;  ///< drives and weights; y is not filled
  std::vector<PlantInput> inputs;  ///< behind those of the plant, for the last rows of the drives
};

/// A sensor that the plant file could name and does not.
struct MenuSensor {
  std::string name;  ///< "with a sensor: acceleration of wheel"
  Sensor sensor;
};

/// Half, 1.5 times and twice the level about the mean; low-passed at half the band of the responses; with noise as fast
/// as the drive (RMS of its rate) up to four times that band or 0.4 of the sampling rate; a triangle of the peak
/// amplitude, alone and slow against the slowest mode; the ride height, a static force in every element between masses
/// that shifts its travel by the RMS it has under the drive. What the plant or the sampling rate has no room for is
/// left out, and schedules stay as they were planned. Deterministic.
/// @param records with the nominal y, as `nominal_outputs` fills it: their spectra tell the band
std::vector<MenuDrive> menu_drives(const Plant& plant, const std::vector<FitRecord>& records);

/// Acceleration of each mass, travel of each element and position of each displacement input, where no sensor of the
/// plant reads it alone.
std::vector<MenuSensor> menu_sensors(const Plant& plant);

}  // namespace wheelhop

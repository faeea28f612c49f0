/// \file
/// How outcomes are reported: wrong use throws UserError, numerical outcomes are a Status inside the returned struct.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace wheelhop {

/// The one exception for wrong use (bad file, bad key, wrong unit, wrong shape). Its message is complete: file, place,
/// what was expected, what was found and, where names are chosen from a list, the known names. The program prints it
/// and exits with 2.
class UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A fault of the machine and not of what the user gave: a disk that is full, a file that may not be read, too many
/// open files, too little memory. What was to be computed may well go right next time, so it is no result to be kept.
class MachineError : public UserError {
 public:
  using UserError::UserError;
};

/// Numerical outcome of a computation. `ok` implies that every number in the result is finite.
enum class Status {
  ok,                ///< done, tolerance met
  iteration_limit,   ///< stopped at the cap; the result is the best so far
  rank_deficient,    ///< the data do not determine the unknowns
  not_stabilisable,  ///< the Riccati equation has no stabilising solution
  unstable,          ///< a model with a pole on or outside the unit circle
  outside_domain,    ///< the state left the region where the laws are defined
  not_finite,        ///< NaN or infinity appeared
  unavailable,       ///< the piece was built without its library
  failed             ///< any other reason, said in the message
};

/// Name of a status as it stands in result files, e.g. "iteration_limit".
std::string_view to_string(Status status);

}  // namespace wheelhop

#include "core/base/status.hpp"

namespace wheelhop {

std::string_view to_string(Status status) {
  switch (status) {
    case Status::ok: return "ok";
    case Status::iteration_limit: return "iteration_limit";
    case Status::rank_deficient: return "rank_deficient";
    case Status::not_stabilisable: return "not_stabilisable";
    case Status::unstable: return "unstable";
    case Status::outside_domain: return "outside_domain";
    case Status::not_finite: return "not_finite";
    case Status::unavailable: return "unavailable";
    case Status::failed: return "failed";
  }
  return "failed";
}

}  // namespace wheelhop

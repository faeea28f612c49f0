/// \file
/// `wheelhop list [--json]`: every swappable piece, law and drive with its options.
#pragma once

#include "core/base/json.hpp"

namespace wheelhop {

/// Families of pieces, laws of plant elements and drives: `{"schema": "wheelhop.list/1", "families": [{"family",
/// "meaning", "pieces": [{"name", "source", "meaning", "available", "unavailable"?, "options": [{"name", "default",
/// "unit", "range", "meaning"}]}]}]}`.
Json list_pieces();

struct ListRequest {
  bool json = false;  ///< otherwise for reading
};

/// Prints that. @return 0
int run_list(const ListRequest& request);

}  // namespace wheelhop

/// \file
/// What a diagnosis shows to people: a heading, the answer, notes and tables, every number written once. The terminal
/// and the page lay them out, and the diagnosis file holds them under `view`.
#pragma once

#include <string>
#include <vector>

#include "core/base/json.hpp"
#include "core/gap/diagnose.hpp"
#include "core/gap/study/examine.hpp"
#include "core/gap/study/placebo.hpp"

namespace wheelhop {

struct ViewTable {
  std::string id;                              ///< by which the page knows where it stands
  std::string caption;                         ///< what the numbers are
  std::vector<std::string> columns;            ///< heads; the first is that of the names of the rows
  std::vector<std::vector<std::string>> rows;  ///< texts, one a column; "-" stands for what is not known
};

struct View {
  std::string heading;
  std::string answer;
  std::vector<std::string> notes;  ///< sentences
  std::vector<ViewTable> tables;   ///< in the order of reading; none is empty
};

/// @param plant as delivered   @param examination null where there is none   @param placebo null where none was asked
/// for
View view_of(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination, const Placebo* placebo);

/// {"heading", "notes", "tables": [{"id", "caption", "columns", "rows"}]}; the answer stands in the file already.
Json to_json(const View& view);

/// Lays a view out on stdout.
void print(const View& view);

}  // namespace wheelhop

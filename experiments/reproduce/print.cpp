#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "experiments/reproduce/table.hpp"

namespace wheelhop {
namespace {

/// One decimal as in the paper; more only where rounding would hide what is left to 100 %.
std::string vaf_text(double vaf) {
  if (!std::isfinite(vaf)) return "failed";
  const double left = 100 - vaf;
  const int decimals = left >= 0.5 || left <= 0 ? 1 : std::min(4, static_cast<int>(std::ceil(-std::log10(left))) + 1);
  return fmt::format("{:.{}f}", vaf, decimals);
}

std::string ratio_text(double ratio) { return std::isfinite(ratio) ? fmt::format("{:.3f}", ratio) : "failed"; }

void print_table(const ReproduceConfig& config, const std::vector<RealisationRow>& rows) {
  fmt::print("Table 1: variance accounted for (%), free run on validation data, {} realisation{}\n",
             config.data.realisations, config.data.realisations == 1 ? "" : "s");
  fmt::print("median [5 %, 95 %] min; \"paper\" is the value printed there\n\n");
  for (std::size_t s = 0; s < 3; ++s) {
    const PaperSignal& paper = kPaperSignals[s];
    fmt::print("{}\n", paper.title);
    for (std::size_t c = 0; c < kColumns; ++c) {
      const Statistics v = column_statistics(rows, c, s);
      std::string printed = "      -";
      if (c == static_cast<std::size_t>(Column::linear)) printed = fmt::format("{:7.1f}", paper.linear_vaf);
      if (c == static_cast<std::size_t>(Column::nonlinear)) printed = fmt::format("{:7.1f}", paper.nonlinear_vaf);
      fmt::print("  {:<11} paper {}   here {:>8}  [{}, {}]  min {}   ({}/{} ok)\n", kColumnNames[c], printed,
                 vaf_text(v.median), vaf_text(v.q05), vaf_text(v.q95), vaf_text(v.min), v.n_ok, v.n);
    }
  }
  fmt::print(
      "\nlinear: subspace estimate. as_printed: eq. (5) and SDI to the letter (no direct term, one-step-ahead f).\n"
      "nonlinear: the algorithm of Sec. 2.7 with the direct term. refined: after the joint refinement.\n");
  if (!config.data.snr_db) return;
  fmt::print("\nRMS of the residual over that of the noise ({:g} dB), 1 is the floor: median, worst\n",
             *config.data.snr_db);
  for (std::size_t s = 0; s < 3; ++s) {
    fmt::print("  {:<24}", kPaperSignals[s].title);
    for (std::size_t c = 0; c < kColumns; ++c) {
      const Statistics v = noise_statistics(rows, c, s);
      fmt::print("  {} {}, {}", kColumnNames[c], ratio_text(v.median), ratio_text(v.min));
    }
    fmt::print("\n");
  }
}

void print_physics(const std::vector<RealisationRow>& rows, const Json& physics) {
  std::vector<double> ratio, fit;
  for (const RealisationRow& row : rows) {
    ratio.push_back(row.direct_ratio);
    fit.push_back(row.spring_r2);
  }
  const Statistics r = statistics_of(std::move(ratio)), f = statistics_of(std::move(fit));
  fmt::print(
      "\nPhysics of the refined model\n"
      "  direct force term, chassis over axle: median {:.4f}; -wheel mass / body mass = {:.4f}\n"
      "  R^2 of the identified nonlinearity against the spring's: median {:.6f}, min {:.6f}\n",
      r.median, physics.at("expected_direct_term_ratio").get<double>(), f.median, f.min);
}

void print_failures(const std::vector<RealisationRow>& rows) {
  for (const RealisationRow& row : rows) {
    if (row.status != Status::ok)
      fmt::print("  realisation {}: {}: {}\n", row.realisation, to_string(row.status), row.message);
    for (std::size_t c = 0; c < kColumns; ++c) {
      const ColumnScore& column = row.columns[c];
      if (row.status == Status::ok && column.status != Status::ok && column.status != Status::iteration_limit)
        fmt::print("  realisation {}, {}: {}: {}\n", row.realisation, kColumnNames[c], to_string(column.status),
                   column.message);
    }
  }
}

}  // namespace

void print_reproduction(const ReproduceConfig& config, const std::vector<RealisationRow>& rows, const Json& table) {
  print_table(config, rows);
  print_physics(rows, table.at("physics"));
  if (const Json& beyond = table.at("beyond_training"); !beyond.empty()) {
    fmt::print("\nValidation records beyond the training range (counted above as well): refined VAF there\n");
    for (const Json& entry : beyond) {
      double furthest = 0;
      for (const Json& share : entry.at("share_of_training_range")) furthest = std::max(furthest, share.get<double>());
      fmt::print("  realisation {:>3}: {} samples, at most {:.1f} % of the range outside;",
                 entry.at("realisation").get<Index>(), entry.at("samples").get<Index>(), 100 * furthest);
      for (const Json& vaf : entry.at("refined_vaf_percent")) fmt::print(" {}", vaf_text(vaf.get<double>()));
      fmt::print("\n");
    }
  }
  print_failures(rows);
  fmt::print("\nWhat the paper does not state, and what was chosen\n");
  for (const Json& note : table.at("notes"))
    fmt::print("  {}: {}\n      {}\n", note.at("what").get<std::string>(), note.at("chosen").get<std::string>(),
               note.at("why").get<std::string>());
}

}  // namespace wheelhop

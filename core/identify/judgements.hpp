/// \file
/// The numbers chosen by us that steer what is identified, in one place: each with its meaning and the reason for it.
/// They stand in every model file, under `provenance.judgements`.
#pragma once

#include "core/base/json.hpp"
#include "core/base/linalg.hpp"

namespace wheelhop {

struct IdentifyJudgements {
  // What a record must excite.
  Index lags = 16;
  Index widest_spacing = 64;
  double chance = 6;
  // Order and delays of the linear model.
  double fitted_share = 0.75;
  double order_margin = 1.03;
  double delay_margin = 1.05;
  double same_delay = 1.01;
  Index orders_beyond = 4;
  Index order_samples = 16384;
  Index delay_samples = 6000;
  Index delay_order = 6;
  Index delay_room = 3;
  double columns_per_row = 1.5;
  // Forms of the nonlinear model that are tried.
  double large_offset = 1;
  double well_explained = 0.1;
  Index lowest_order = 2;
  double same_order = 1.03;
  double same_order_beyond_noise = 1.2;
  Index idle_orders = 3;
  double start_samples = 3072;
  Index start_work = 120000;
  Index most_starts = 16;
  double samples_per_parameter = 100;
  Index most_growth = 2;
  Index growth_iterations = 2;
  double one_direction = 0.5;
  double worth_a_power = 6.63;
  double one_sign = 1e-3;
  double robust_map = 1.25;
  // Which of them is delivered.
  double noise_share = 0.1;
  Index residual_lags = 10;
  double not_worse = 1.02;
  Index compared_blocks = 12;
  double certain = 2;
  double excursion = 0.5;
  double excursion_of_linear = 2;
  Index drive_pieces = 8;
  Index drawn_drives = 2;
  double same_fit = 1.25;
  Index fewest_alike = 3;
  // How sure it is.
  Index scatter_blocks = 40;
  Index shortest_block = 20;
  double moves_along = 1e-3;

  /// Calls visit(name, value, meaning and reason) for each.
  template <class V>
  void fields(V&& visit) const {
    visit("lags", lags, "lags of the window in which a drive of one frequency is told from one of several");
    visit("widest_spacing", widest_spacing, "samples between these lags, at most");
    visit("chance", chance, "standard deviations of a chi-square variable from its mean that count as chance");
    visit("fitted_share", fitted_share,
          "share of each record that is fitted while models are compared on the rest: a quarter is enough to compare");
    visit("order_margin", order_margin,
          "factor of the free-run error by which an order has to be better than a lower one: inside what two records "
          "of one plant differ by");
    visit("delay_margin", delay_margin, "the same for a set of delays against a simpler one");
    visit("same_delay", same_delay, "factor within which the errors of two delays are equal: the shorter one is taken");
    visit("orders_beyond", orders_beyond, "orders tried beyond the last that brought something: two pairs of poles");
    visit("order_samples", order_samples, "samples on which orders are compared, at most: it bounds the time");
    visit("delay_samples", delay_samples, "samples on which delays are sought, at most: likewise");
    visit("delay_order", delay_order,
          "order of the pole sets that delays are sought with: more modes than most plants have in a band");
    visit("delay_room", delay_room, "samples around the delays found in which they are sought anew");
    visit("columns_per_row", columns_per_row,
          "columns of a block-Hankel matrix over its rows that tell its column space, at least");
    visit("large_offset", large_offset,
          "offset over standard deviation of a channel from which it is taken out: smaller ones change an RMS by less "
          "than half");
    visit("well_explained", well_explained,
          "share of the linear model's error below which another form of the direct term gains nothing");
    visit("lowest_order", lowest_order,
          "order tried with the nonlinearity, at least: a mass on a spring has two states");
    visit("same_order", same_order, "factor of the error in any output by which a lower order may be worse");
    visit("same_order_beyond_noise", same_order_beyond_noise,
          "the same where the better order leaves more than noise: its modes stand for part of what neither has");
    visit("idle_orders", idle_orders,
          "orders in a row that bring less than that and end the search: a pair and one more");
    visit("start_samples", start_samples,
          "fitted samples from which on one start suffices; on fewer, the square of their ratio: on a thousand samples "
          "the best of five was in a poor minimum in one of three cases, the best of sixteen in none of six");
    visit("start_work", start_work, "samples of all starts times the square of the order, at most");
    visit("most_starts", most_starts, "starts of one record, at most");
    visit("samples_per_parameter", samples_per_parameter,
          "fitted samples a parameter from which a wider map is tried: they determine it to a tenth of the residual");
    visit("most_growth", most_growth, "times that the units of a map are doubled, at most");
    visit("growth_iterations", growth_iterations,
          "iterations of the refinement of a wider map, in those of the first: wide maps converge slowly");
    visit("one_direction", one_direction,
          "share of the gradient's variance in one direction from which a map is tried as a ridge function: one spare "
          "unit on a few noisy samples takes a tenth and more");
    visit("worth_a_power", worth_a_power,
          "chi2 that each power of a ridge polynomial has to bring: the 99 % point with one degree of freedom");
    visit("one_sign", one_sign,
          "share of the cost that powers of one sign may add, against powers that cancel: the error of a model that "
          "steps "
          "from sample to sample, (T^2 / 12) d2f/dt2, looks like such powers");
    visit("robust_map", robust_map,
          "factor by which the map as given may be worse than the polynomial in its place: a drive a tenth harder "
          "makes more of a difference to a polynomial");
    visit("noise_share", noise_share,
          "share of a residual that follows from its past and the inputs below which it is noise: such a model is "
          "within six in a hundred of it");
    visit("residual_lags", residual_lags, "samples of that past: more than a model error of one mode needs");
    visit("not_worse", not_worse,
          "factor by which a candidate may be worse than the linear model in an output: what two fits of one model "
          "differ by on another record");
    visit("compared_blocks", compared_blocks, "blocks of held-out samples in which two models are compared");
    visit("certain", certain, "standard errors over these blocks from which a difference counts: one-sided 2 %");
    visit("excursion", excursion,
          "share of their range by which outputs on other drives of the same kind may leave it: a resonance stays "
          "within, a model that runs away does not");
    visit("excursion_of_linear", excursion_of_linear, "the same, over what the linear model's outputs do");
    visit("drive_pieces", drive_pieces, "pieces of the drive that are put into another order to make another one");
    visit("drawn_drives", drawn_drives, "such drives, beside the one backwards in time");
    visit("same_fit", same_fit,
          "factor of the best start's error within which starts fit alike: within a quarter minima differ by chance");
    visit("fewest_alike", fewest_alike, "starts that are compared with the middle one of their group, at least");
    visit("scatter_blocks", scatter_blocks,
          "blocks whose scatter tells the standard errors: forty know it to a ninth of itself");
    visit("shortest_block", shortest_block, "samples of a block, at least: most of a residual's colour has died out");
    visit("moves_along", moves_along,
          "share of its slope by which a function may move along directions that the records do not determine: far "
          "more than differences leave of one that does not depend on them");
  }
};

inline constexpr IdentifyJudgements kJudged{};

/// {NAME: {"value", "meaning"}} of all.
inline Json to_json(const IdentifyJudgements& judgements) {
  Json all;
  judgements.fields([&](const char* name, auto value, const char* meaning) {
    all[name] = {{"value", value}, {"meaning", meaning}};
  });
  return all;
}

}  // namespace wheelhop

/// \file
/// The thresholds of the verdict: every number that turns evidence into an answer, with its meaning and its origin.
/// They stand in each diagnosis file, and `wheelhop decide` reads them back from there.
#pragma once

#include "core/base/json.hpp"

namespace wheelhop {

/// Where a threshold comes from.
enum class Origin {
  derived,     ///< follows from a theorem or from the others
  literature,  ///< stands in a source
  learnt,      ///< fitted by a committed command
  judgement    ///< chosen by us, for the reason that is given
};

struct Thresholds {
  // What counts as a gap.
  double notice = 40;
  double too_small = 0.1;
  double floor_errors = 2;
  // How probable a candidate is.
  double of_gap = 0.01;
  double of_gap_closed = 0.005;
  double of_gap_instruments = 1e-4;
  double of_remains = 0.05;
  double errors_of_form = 1;
  double floor_error = 0.05;
  double occam = 1.5;
  double place_weight = 4;
  double limit = 0.99;
  double considered = 0.05;
  // Parameters.
  double out_of_tolerance = 3;
  double not_home = 4;
  double one_wrong = 0.2;
  double wrong_by = 3;
  double directions = 300;
  double stands_out = 0.75;
  // A second effect.
  double second = 0.5;
  double second_there = 0.7;
  double turned = 1.0 / 3;
  double worth_second = 0.06;
  double worth_pair = 0.1;
  double much_left = 1;
  double of_rest = 0.1;
  double grows = 0.25;
  // Doubt in a name.
  double held = 0.97;
  double held_slope = 1.2;
  double held_far = 0.8;
  double explains = 0.6;
  double surely_not = 0.8;
  double explains_well = 0.9;
  double elsewhere = 1.5;
  double far_elsewhere = 4;
  double odd_size = 2.5;
  // Calibration of probabilities.
  double calibration_shift = 0.4;
  double calibration_slope = 1.5;
  double surest = 0.98;
  // A place without a name.
  double clearly = 0.05;
  double remainder = 0.25;
  double read = 0.3;
  double doubt = 0.5;
  double rounded = 0.15;
  double rounding_seen = 0.95;

  /// Calls visit(name, value, unit, meaning, origin, why) for each.
  template <class V>
  void fields(V&& visit) {
    using enum Origin;
    visit(
        "notice", notice, "chi2", "fall of chi2, over the noise's colour, from which a candidate is more than chance",
        judgement,
        "of 300 candidates with three parameters none reaches it by chance with probability 1 - 3e-6 (chi2 quantile)");
    visit("too_small", too_small, "reduced chi2 - 1", "gap below which nothing is said of what is missing", judgement,
          "a third of the noise level in RMS; the noise floor from a few repeats is known to a few per cent");
    visit("floor_errors", floor_errors, "standard errors",
          "of the floor's power, likewise: a gap within them is not told from a floor that is too low", literature,
          "the 5 % level");
    visit("of_gap", of_gap, "-", "share of the gap by which candidates of an inexact form differ without meaning",
          judgement, "seen on generated rigs whose laws have other formulas than the catalogue's");
    visit("of_gap_closed", of_gap_closed, "-", "likewise, where a candidate closes the gap to the floor", judgement,
          "half of of_gap: of 195 generated cases `blind calibrate` finds the loss least between a third and a half");
    visit("of_gap_instruments", of_gap_instruments, "-", "likewise, between laws of one instrument", judgement,
          "delays, lags and factors are exact but for how a path is interpolated: one per cent of the amplitude");
    visit("of_remains", of_remains, "-", "share of what the best candidate leaves, likewise", judgement,
          "what is left shows how inexact the forms are");
    visit("errors_of_form", errors_of_form, "-",
          "independent errors that a form of another formula makes; the evidence falls with what a candidate leaves to "
          "half their power",
          judgement, "one is the least; a wrong family hardly leaves nothing by chance");
    visit("floor_error", floor_error, "-", "relative error of the floor, within which nothing counts as left",
          judgement, "a floor from two repeats is known to a few per cent");
    visit("occam", occam, "log p", "what one more fitted parameter costs", judgement,
          "between 1 (Akaike 1974) and half the log of the number of independent blocks of a record (Schwarz 1978)");
    visit("place_weight", place_weight, "-",
          "power of the leftover at a candidate's place over that at the best place, taken from its probability",
          judgement, "an unknown signal tells places without a catalogue, but linearised");
    visit("limit", limit, "-", "largest probability", judgement, "no catalogue is complete");
    visit("considered", considered, "-", "probability from which a rival is told beside the answer", literature,
          "the 5 % level");
    visit("out_of_tolerance", out_of_tolerance, "tolerances", "leave-prior-out z from which a parameter is wrong",
          literature, "three standard deviations");
    visit("not_home", not_home, "tolerances", "z of another parameter that refutes a single wrong one", judgement,
          "one more than out_of_tolerance: the largest of a dozen parameters");
    visit("one_wrong", one_wrong, "-", "prior probability that one parameter stands out from the others", judgement,
          "a component test is wrong now and then");
    visit("wrong_by", wrong_by, "tolerances",
          "size of a wrong parameter: its standard deviation, or the scale of a Cauchy distribution", judgement,
          "where a deviation begins to be out of tolerance");
    visit("directions", directions, "-",
          "effective number of independent directions of the residuals over which the error of a form is spread; what "
          "moves one parameter is one of them",
          judgement,
          "parameters beside effects of 1,014 generated cases are told with the least log loss from 200 on to 1,000");
    visit("stands_out", stands_out, "-", "probability from which one parameter among nearer ones is named", judgement,
          "odds of three to one");
    visit("second", second, "-", "share of what the first effect leaves that a second one removes; likewise of places",
          judgement, "the larger half of what is missing");
    visit("turned", turned, "-", "share of what re-tuning leaves that the right sign of a channel must remove",
          judgement, "a plant bent by the wrong sign follows much of what the right one does");
    visit("second_there", second_there, "-", "likewise, where another effect stands that is not of the opposite kind",
          judgement, "there it may be no more than the error of that one's form");
    visit("worth_second", worth_second, "-", "share of the gap that is left, from which a second effect is looked for",
          judgement, "forms of another formula leave up to so much");
    visit("worth_pair", worth_pair, "-", "share of the gap that the larger of two effects removes alone", judgement,
          "of two effects one is the larger");
    visit("much_left", much_left, "reduced chi2 - 1", "what is left, likewise, however little of the gap that is",
          judgement, "as much as the noise");
    visit("of_rest", of_rest, "-",
          "share that further effects may leave of what an effect's form may leave, to be named all the same",
          judgement, "by chance an effect that is not there follows the error of a form in part, and not nearly whole");
    visit("grows", grows, "-",
          "share of what is left that a further effect removes at least, for sets with it to be grown further",
          judgement, "of four effects of one size the first to be found removes a quarter");
    visit("held", held, "-", "probability that the catalogue holds what explains a gap whole", judgement,
          "thirty families against what a rig may have");
    visit("held_slope", held_slope, "-", "what an unexplained share takes from it", judgement,
          "an answer that explains a fifth has none");
    visit("held_far", held_far, "-",
          "probability that a name is right although its form leaves far more than the noise and than `of_gap` of the "
          "gap; of a further effect that of the one before it, times this",
          judgement,
          "looked at by hand on 23 rigs of another simulator whose answers leave more than twice the noise's power: of "
          "17 single names 12 were right, of the names in sets about half");
    visit("explains", explains, "-", "share of chi2 below which no family of the catalogue fits", judgement,
          "looked at on generated rigs: families of another formula explain more, wrong ones less");
    visit("surely_not", surely_not, "-", "upper end of the closure below which it does not fit", judgement, "likewise");
    visit("explains_well", explains_well, "-",
          "share of chi2 from which only a far better place speaks against it; of sensors, drives and the clock, whose "
          "forms are few, also the closure that is needed",
          judgement, "likewise");
    visit("elsewhere", elsewhere, "-", "leftover of a place over that of the best, from which the gap enters elsewhere",
          judgement, "half as much again");
    visit("far_elsewhere", far_elsewhere, "-", "likewise, where the effect explains the gap well", judgement,
          "leftovers are linearised");
    visit("odd_size", odd_size, "standard deviations",
          "of a defining size above the usual, from which it is another effect", derived,
          "one in 160 true ones, of the literature's range taken for nine of ten");
    visit("calibration_shift", calibration_shift, "log odds", "of a named effect, added to its log odds", judgement,
          "by eye from 754 answers on generated sets");
    visit("calibration_slope", calibration_slope, "-", "of a named effect, factor on its log odds", judgement,
          "likewise");
    visit("surest", surest, "-", "largest probability of a named effect", judgement, "likewise");
    visit("clearly", clearly, "-", "share of the unknown signal by which another motion explains more", judgement,
          "more than chance makes (0.04)");
    visit("remainder", remainder, "-", "or share of what is unexplained that it leaves", judgement, "a quarter");
    visit("read", read, "-", "share that a law of an element makes of its own motion at least", judgement,
          "off-catalogue laws of elements explained more on generated rigs");
    visit("doubt", doubt, "-", "largest probability of a place that does not explain all channels", judgement,
          "even odds");
    visit("rounded", rounded, "-", "share of the floor that rounding makes, from which the converter is named",
          judgement, "below it other noise is the reason for the floor");
    visit("rounding_seen", rounding_seen, "-", "probability of a lattice that was seen in the readings", judgement,
          "the 5 % level");
  }
};

/// [{"name", "value", "unit", "meaning", "origin", "why"}, ...]
Json to_json(const Thresholds& thresholds);
/// Reads such a list over others. UserError on a name that is no threshold, or a value that is no number.
Thresholds thresholds_from(const JsonCursor& list, Thresholds thresholds = {});

}  // namespace wheelhop

/// \file
/// What a drive excites, judged by what the outputs follow: noise of a measured drive is rich, and moves nothing.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// How many independent directions of the drive's recent past the outputs follow. One sine has two, however much noise
/// its measurement carries; a drive that identifies a model of order n has at least n + 1.
///
/// The principal components z_j of [u_k, u_{k-q}, ..., u_{k-(K-1)q}], largest first, for several q. They are
/// orthogonal, so that each takes (z_j y)^2 / |z_j|^2 off the squared error of a regression of y. The order is the
/// least number of them beyond which the others take off no more than by chance: their sum, over the variance of what
/// the regression leaves, has as its mean its degrees of freedom d and the variance 2 d; six deviations count as
/// chance.
/// @param u m x N   @param y p x N   @param limit counted up to here
/// Cost O(N m^2) times the square of the number of lags and the number of spacings.
Index followed_directions(ConstMatrixRef u, ConstMatrixRef y, Index limit);

/// Index of an input that is a combination of earlier and later samples of the others and of itself no more than of
/// round-off: the share of its square beyond the others at up to four samples' distance is below 1e-10; -1: none.
Index collinear_input(ConstMatrixRef u);

}  // namespace wheelhop

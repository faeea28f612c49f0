/// \file
/// SLICOT, LAPACK and BLAS as this bench calls them. Matrices are column-major; calls return INFO, 0 for success.
/// SLICOT's library: Benner, Mehrmann, Sima, Van Huffel & Varga 1999. Names and arguments as in its documentation.
#pragma once

#include <string>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop::peers {

/// Records as SLICOT wants them: samples x channels.
struct Record {
  Matrix u, y;
};

enum class Feeding { whole, batches };
inline constexpr int kBatch = 20000;  ///< the length at which its fast algorithm does best

/// Factor of [U_past; U_future; Y_past; Y_future] by IB01MD. @param algorithm 'C' (Cholesky, its default) or 'Q'
/// @param factor 2 (m + p) s square, upper triangular   @return INFO; `warning` counts IWARN: 'C' went over to QR
int slicot_factor(const Record& record, int s, char algorithm, Feeding feeding, Matrix& factor, int& warning);

struct Identified {
  Matrix A, B, C, D;
  Vector x0;
};
/// IB01AD, IB01BD and IB01CD: order n given.
int slicot_identify(const Record& record, int s, int n, Feeding feeding, Identified& model);

/// Filter form of solve_dare() by SB02OD. @param P out
int slicot_dare(const Matrix& A, const Matrix& C, const Matrix& Q, const Matrix& R, Matrix& P);

/// R of the QR factorisation of rows (overwritten) by dgeqrf.
int lapack_qr(Matrix& rows);
/// Lower Cholesky factor of rows' rows by dsyrk and dpotrf.
int lapack_gram(const Matrix& rows, Matrix& factor);

/// Which BLAS the loader found, by the path of its file, and which of its kernels OpenBLAS runs.
std::string blas_in_use();

}  // namespace wheelhop::peers

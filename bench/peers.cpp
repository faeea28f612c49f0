#include "bench/peers.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

extern "C" {
void ib01md_(const char* meth, const char* alg, const char* batch, const char* conct, const int* nobr, const int* m,
             const int* l, const int* nsmp, const double* u, const int* ldu, const double* y, const int* ldy, double* r,
             const int* ldr, int* iwork, double* dwork, const int* ldwork, int* iwarn, int* info);
void ib01ad_(const char* meth, const char* alg, const char* jobd, const char* batch, const char* conct,
             const char* ctrl, const int* nobr, const int* m, const int* l, const int* nsmp, const double* u,
             const int* ldu, const double* y, const int* ldy, int* n, double* r, const int* ldr, double* sv,
             const double* rcond, const double* tol, int* iwork, double* dwork, const int* ldwork, int* iwarn,
             int* info);
void ib01bd_(const char* meth, const char* job, const char* jobck, const int* nobr, const int* n, const int* m,
             const int* l, const int* nsmpl, double* r, const int* ldr, double* a, const int* lda, double* c,
             const int* ldc, double* b, const int* ldb, double* d, const int* ldd, double* q, const int* ldq,
             double* ry, const int* ldry, double* s, const int* lds, double* k, const int* ldk, const double* tol,
             int* iwork, double* dwork, const int* ldwork, int* bwork, int* iwarn, int* info);
void ib01cd_(const char* jobx0, const char* comuse, const char* job, const int* n, const int* m, const int* l,
             const int* nsmp, const double* a, const int* lda, double* b, const int* ldb, const double* c,
             const int* ldc, double* d, const int* ldd, double* u, const int* ldu, const double* y, const int* ldy,
             double* x0, double* v, const int* ldv, const double* tol, int* iwork, double* dwork, const int* ldwork,
             int* iwarn, int* info);
void sb02od_(const char* dico, const char* jobb, const char* fact, const char* uplo, const char* jobl, const char* sort,
             const int* n, const int* m, const int* p, const double* a, const int* lda, const double* b, const int* ldb,
             const double* q, const int* ldq, const double* r, const int* ldr, const double* l, const int* ldl,
             double* rcond, double* x, const int* ldx, double* alfar, double* alfai, double* beta, double* s,
             const int* lds, double* t, const int* ldt, double* u, const int* ldu, const double* tol, int* iwork,
             double* dwork, const int* ldwork, int* bwork, int* info);
void dgeqrf_(const int* m, const int* n, double* a, const int* lda, double* tau, double* work, const int* lwork,
             int* info);
void dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha, const double* a,
            const int* lda, const double* beta, double* c, const int* ldc);
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
}

namespace wheelhop::peers {
namespace {

int as_int(Index value) { return static_cast<int>(value); }

/// Workspaces are kept from call to call: no peer pays for allocation.
double* workspace(std::size_t size) {
  static std::vector<double> memory;
  if (memory.size() < size) memory.resize(size);
  return memory.data();
}
int* integer_workspace(std::size_t size) {
  static std::vector<int> memory;
  if (memory.size() < size) memory.resize(size);
  return memory.data();
}

/// Calls visit(BATCH, first sample, samples) for every batch of a record.
template <class Visit>
int in_batches(int samples, Feeding feeding, Visit&& visit) {
  if (feeding == Feeding::whole || samples <= kBatch) return visit("O", 0, samples);
  for (int first = 0; first < samples; first += kBatch) {
    const bool last = first + kBatch >= samples;
    const int info = visit(first == 0 ? "F" : last ? "L" : "I", first, std::min(kBatch, samples - first));
    if (info != 0) return info;
  }
  return 0;
}

constexpr int kWork = 6000000;

}  // namespace

int slicot_factor(const Record& record, int s, char algorithm, Feeding feeding, Matrix& factor, int& warning) {
  const int m = as_int(record.u.cols()), l = as_int(record.y.cols()), samples = as_int(record.u.rows());
  const int size = 2 * (m + l) * s, stride = samples;
  factor.resize(size, size);
  int* const integers = integer_workspace(100000);
  double* const work = workspace(kWork);
  warning = 0;
  return in_batches(samples, feeding, [&](const char* batch, int first, int count) {
    int warn = 0, info = 0;
    ib01md_("M", &algorithm, batch, *batch == 'O' ? "N" : "C", &s, &m, &l, &count, record.u.data() + first, &stride,
            record.y.data() + first, &stride, factor.data(), &size, integers, work, &kWork, &warn, &info);
    warning += warn != 0;
    return info;
  });
}

int slicot_identify(const Record& record, int s, int n, Feeding feeding, Identified& model) {
  const int m = as_int(record.u.cols()), l = as_int(record.y.cols()), samples = as_int(record.u.rows());
  const int rows = std::max(2 * (m + l) * s, 3 * m * s), width = 2 * (m + l) * s, stride = samples;
  Matrix factor(rows, width);
  Vector values(l * s);
  const double automatic = -1;
  int* const integers = integer_workspace(100000);
  double* const work = workspace(kWork);
  int order = n, warn = 0;
  int info = in_batches(samples, feeding, [&](const char* batch, int first, int count) {
    int failed = 0;
    order = n;
    ib01ad_("M", "C", "N", batch, *batch == 'O' ? "N" : "C", "N", &s, &m, &l, &count, record.u.data() + first, &stride,
            record.y.data() + first, &stride, &order, factor.data(), &rows, values.data(), &automatic, &automatic,
            integers, work, &kWork, &warn, &failed);
    return failed;
  });
  if (info != 0) return info;
  model.A.resize(n, n);
  model.B.resize(n, m);
  model.C.resize(l, n);
  model.D.resize(l, m);
  model.x0.resize(n);
  int logical[1000];
  double unused[1];
  const int one = 1;
  ib01bd_("M", "C", "N", &s, &n, &m, &l, &samples, factor.data(), &rows, model.A.data(), &n, model.C.data(), &l,
          model.B.data(), &n, model.D.data(), &l, unused, &one, unused, &one, unused, &one, unused, &one, &automatic,
          integers, work, &kWork, logical, &warn, &info);
  if (info != 0) return info;
  Matrix input = record.u;
  Matrix schur(n, n);
  ib01cd_("X", "C", "D", &n, &m, &l, &samples, model.A.data(), &n, model.B.data(), &n, model.C.data(), &l,
          model.D.data(), &l, input.data(), &stride, record.y.data(), &stride, model.x0.data(), schur.data(), &n,
          &automatic, integers, work, &kWork, &warn, &info);
  return info;
}

int slicot_dare(const Matrix& A, const Matrix& C, const Matrix& Q, const Matrix& R, Matrix& P) {
  const int n = as_int(A.rows()), p = as_int(C.rows()), both = 2 * n + p, twice = 2 * n, one = 1;
  const Matrix dual = A.transpose(), input = C.transpose();
  P.resize(n, n);
  double* const work = workspace(kWork);
  Vector real(twice), imaginary(twice), beta(twice);
  Matrix S(both, both), T(both, twice), U(twice, twice);
  std::vector<int> logical(static_cast<std::size_t>(twice));
  double rcond = 0, unused = 0;
  const double automatic = 0;
  int info = 0;
  sb02od_("D", "B", "N", "U", "Z", "S", &n, &p, &p, dual.data(), &n, input.data(), &n, Q.data(), &n, R.data(), &p,
          &unused, &one, &rcond, P.data(), &n, real.data(), imaginary.data(), beta.data(), S.data(), &both, T.data(),
          &both, U.data(), &twice, &automatic, integer_workspace(100000), work, &kWork, logical.data(), &info);
  return info;
}

int lapack_qr(Matrix& rows) {
  const int m = as_int(rows.rows()), n = as_int(rows.cols());
  Vector tau(n);
  int info = 0;
  dgeqrf_(&m, &n, rows.data(), &m, tau.data(), workspace(kWork), &kWork, &info);
  return info;
}

int lapack_gram(const Matrix& rows, Matrix& factor) {
  const int n = as_int(rows.rows()), k = as_int(rows.cols());
  const double one = 1, zero = 0;
  factor.resize(n, n);
  int info = 0;
  dsyrk_("L", "N", &n, &k, &one, rows.data(), &n, &zero, factor.data(), &n);
  dpotrf_("L", &n, factor.data(), &n, &info);
  return info;
}

std::string blas_in_use() {
  const void* const loaded = ::dlsym(RTLD_DEFAULT, "dsyrk_");
  Dl_info info;
  if (loaded == nullptr || ::dladdr(loaded, &info) == 0 || info.dli_fname == nullptr) return "unknown";
  // Folder and file: Debian's packages differ in the folder.
  const std::filesystem::path file(info.dli_fname);
  std::string name = (file.parent_path().filename() / file.filename()).string();
  if (void* const core = ::dlsym(RTLD_DEFAULT, "openblas_get_corename"))
    name += fmt::format(" (OpenBLAS, kernels {})", reinterpret_cast<const char* (*)()>(core)());
  return name;
}

}  // namespace wheelhop::peers

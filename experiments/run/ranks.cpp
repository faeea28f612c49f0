#include "experiments/run/ranks.hpp"

#include <cstdlib>

#include "core/base/status.hpp"

#ifdef WHEELHOP_HAS_MPI
#include <mpi.h>
#include <unistd.h>
#endif

namespace wheelhop {
namespace {

/// Number of processes that a launcher started, 1 where none did, as the environment says: Open MPI's mpirun, PMI
/// (MPICH's mpiexec, srun --mpi=pmi2), Slurm's srun with any other plugin, PMIx among them.
int launched() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"})
    if (const char* const value = std::getenv(name)) return std::max(1, std::atoi(value));
  return 1;
}

}  // namespace

#ifdef WHEELHOP_HAS_MPI

namespace {
// Calls go by MPI's second names, PMPI_. The solver that Ipopt brings along holds a stand-in for MPI under the first
// ones, which says that every process is alone.
constexpr int kAsk = 1, kAssign = 2;
}  // namespace

Ranks::Ranks() {
  const int processes = launched();
  if (processes == 1) return;
  int provided = 0;
  PMPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  started_ = true;
  PMPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  PMPI_Comm_size(MPI_COMM_WORLD, &size_);
  if (size_ == processes) return;
  PMPI_Finalize();
  throw UserError(
      "the launcher started several processes that do not see one another; under Slurm start them with "
      "srun --mpi=pmix, or take --shard");
}

Ranks::~Ranks() {
  if (started_) PMPI_Finalize();
}

bool Ranks::agree(bool go_on) {
  int flag = go_on;
  if (size_ > 1) PMPI_Bcast(&flag, 1, MPI_INT, 0, MPI_COMM_WORLD);
  return flag != 0;
}

std::optional<Delivery> Ranks::poll() {
  if (size_ == 1) return {};
  int waits = 0;
  MPI_Status status;
  PMPI_Iprobe(MPI_ANY_SOURCE, kAsk, MPI_COMM_WORLD, &waits, &status);
  if (!waits) return {};
  int count = 0;
  PMPI_Get_count(&status, MPI_CHAR, &count);
  std::string message(static_cast<std::size_t>(count), '\0');
  PMPI_Recv(message.data(), count, MPI_CHAR, status.MPI_SOURCE, kAsk, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return Delivery{status.MPI_SOURCE, !message.empty(), std::move(message)};
}

void Ranks::assign(int rank, std::int64_t work) { PMPI_Send(&work, 1, MPI_INT64_T, rank, kAssign, MPI_COMM_WORLD); }

std::int64_t Ranks::ask(const std::optional<std::string>& result) {
  PMPI_Send(result ? result->data() : nullptr, result ? static_cast<int>(result->size()) : 0, MPI_CHAR, 0, kAsk,
            MPI_COMM_WORLD);
  std::int64_t work = -1;
  MPI_Request request;
  PMPI_Irecv(&work, 1, MPI_INT64_T, 0, kAssign, MPI_COMM_WORLD, &request);
  // A blocking receive would keep a core busy while there is nothing to do.
  for (int done = 0;;) {
    PMPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done) return work;
    ::usleep(200);
  }
}

void Ranks::abort(int exit_status) {
  if (started_) PMPI_Abort(MPI_COMM_WORLD, exit_status);
  std::_Exit(exit_status);
}

#else

Ranks::Ranks() {
  if (launched() > 1)
    throw UserError(
        "a launcher started several processes, and this build is without MPI (Debian: libopenmpi-dev); "
        "take --shard i/n instead");
}
Ranks::~Ranks() = default;
bool Ranks::agree(bool go_on) { return go_on; }
std::optional<Delivery> Ranks::poll() { return {}; }
void Ranks::assign(int, std::int64_t) {}
std::int64_t Ranks::ask(const std::optional<std::string>&) { return -1; }
void Ranks::abort(int exit_status) { std::_Exit(exit_status); }

#endif

}  // namespace wheelhop

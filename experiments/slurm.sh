#!/usr/bin/env bash
# A sweep as a Slurm job:
#   sbatch -n 32 experiments/slurm.sh CONFIG DIR             one MPI job; rank 0 hands out rows and writes
#   sbatch --array=1-32 experiments/slurm.sh CONFIG DIR      an array; every task is a shard, the last one writes the table
#   WHEELHOP_SHARDS=32 sbatch --array=7,9 experiments/slurm.sh CONFIG DIR      some tasks of that array again
# Stopped at its time limit, the same command goes on. DIR must lie on a file system that all nodes see.
#SBATCH --job-name=wheelhop-sweep
#SBATCH --cpus-per-task=1
#SBATCH --time=04:00:00
set -euo pipefail
[[ $# -eq 2 ]] || { echo 'usage: sbatch [-n RANKS | --array=1-N] slurm.sh CONFIG DIR' >&2; exit 2; }
# Under sbatch this file is a copy; the folder in which sbatch was called is that of the project.
program=${WHEELHOP_PROGRAM:-${SLURM_SUBMIT_DIR:-.}/build/release/experiments/wheelhop}
export WHEELHOP_HOME=${WHEELHOP_HOME:-${SLURM_SUBMIT_DIR:-.}}
if [[ -n ${SLURM_ARRAY_TASK_ID-} ]]; then
  shards=${WHEELHOP_SHARDS:-$SLURM_ARRAY_TASK_COUNT}
  if (( SLURM_ARRAY_TASK_ID < 1 || SLURM_ARRAY_TASK_ID > shards )); then
    echo "slurm.sh: task $SLURM_ARRAY_TASK_ID of $shards shards; take --array=1-N, or say N by WHEELHOP_SHARDS" >&2
    exit 2
  fi
  exec "$program" sweep "$1" --out "$2" --jobs "${SLURM_CPUS_PER_TASK:-1}" --shard "$SLURM_ARRAY_TASK_ID/$shards"
fi
exec srun --mpi=pmix "$program" sweep "$1" --out "$2"

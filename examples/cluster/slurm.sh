#!/bin/bash
# A batch as an array of Slurm tasks, a part for each:
#
#   sbatch --array=1-16 slurm.sh shapes.txt runs/shapes
#
# Some parts again, of an array that had 16:
#
#   sbatch --array=3,7 --export=ALL,PARTS=16 slurm.sh shapes.txt runs/shapes
#
#SBATCH --job-name=ndf
#SBATCH --cpus-per-task=8
#SBATCH --mem=32G
#SBATCH --time=12:00:00
#SBATCH --requeue
#SBATCH --signal=TERM@120

set -eu
list=$1
run=$2

# A number of parts that is given wins over that of the array. --resume costs nothing the first time, and takes up what a task
# that was requeued has left.
exec srun ndf batch fit "@$list" -o "$run" ${PARTS:+--shard "$SLURM_ARRAY_TASK_ID/$PARTS"} \
    --timeout 900 --memory 3G --resume -- --size 9000

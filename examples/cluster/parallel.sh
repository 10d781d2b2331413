#!/bin/sh
# Every file of a list through GNU parallel, on this machine or, with --sshloginfile, on several:
#
#   sh parallel.sh shapes.txt runs/parallel
#
# run again, it does what failed or is missing (--resume-failed). runs/parallel/joblog has a line for every file.
set -eu
list=$1
run=$2
mkdir -p "$run"

# The number {#} of the line names the results, so that files of one name do not collide.
export run
parallel --joblog "$run/joblog" --resume-failed --timeout 900 --memfree 2G --env run --workdir . \
    'ndf fit {} -o "$run/{#}.ndf" --checkpoint "$run/{#}.checkpoint" --size 9000 --threads 1 --json --quiet \
         > "$run/{#}.json" 2> "$run/{#}.txt"' :::: "$list" ||
    echo "$? of the files failed; the column Exitval of $run/joblog says which" >&2

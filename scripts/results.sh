#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Prints the table of results of README.md as Markdown.
#
#   bash scripts/results.sh [--programs FOLDER] [--keep FOLDER] SCAN[:N]...
#
# SCAN is the folder of a recording that holds true poses; SCAN:N takes every N-th frame. Each
# recording is reconstructed with the defaults of bundle_icp_reconstruct and evaluated with
# bundle_icp_evaluate. Time and peak memory are those of the whole bundle_icp_reconstruct.
#   --programs FOLDER  where the programs are, default: build/release/bin
#   --keep FOLDER      keeps the results there, default: they are removed
# Messages go to the error stream. A recording that fails ends the script with exit code 1.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)

programs=$here/build/release/bin
keep=
scans=()
while [ $# -gt 0 ]; do
  case $1 in
    --programs) programs=${2:?"--programs needs a folder"}; shift 2 ;;
    --keep) keep=${2:?"--keep needs a folder"}; shift 2 ;;
    -h | --help) sed -n '3,/^set/{/^set/!s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    -*) echo "results.sh: unknown option $1" >&2; exit 2 ;;
    *) scans+=("$1"); shift ;;
  esac
done
if [ ${#scans[@]} -eq 0 ]; then
  echo "Usage: results.sh [--programs FOLDER] [--keep FOLDER] SCAN[:N]..." >&2
  exit 2
fi
for program in bundle_icp_reconstruct bundle_icp_evaluate; do
  if [ ! -x "$programs/$program" ]; then
    echo "results.sh: $programs/$program is not built" >&2
    exit 1
  fi
done

results=$keep
if [ -z "$keep" ]; then
  results=$(mktemp -d)
  trap 'rm -rf "$results"' EXIT
fi
commit=$(git -C "$here" describe --always --dirty 2>/dev/null || echo unknown)
processor=$(sed -n 's/^model name[^:]*: *//p' /proc/cpuinfo 2>/dev/null | head -1)

export LC_ALL=C PYTHONDONTWRITEBYTECODE=1
python3 - "$programs" "$results" "$commit" "$(nproc)" "${processor:-unknown processor}" "${scans[@]}" <<'PYTHON'
import json
import os
import re
import subprocess
import sys
import time

programs, results, commit, cores, processor = sys.argv[1:6]


def fail(message):
    sys.exit(f'results.sh: {message}')


def run(command, out):
    """Standard output to the file `out`; wall time [s] and peak memory [bytes]."""
    start = time.monotonic()
    with open(out, 'w') as stream:
        process = subprocess.Popen(command, stdout=stream)
        _, status, usage = os.wait4(process.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    if code != 0:
        fail(f'{command[0]} ended with exit code {code}')
    return time.monotonic() - start, 1024 * usage.ru_maxrss


def length(metres):
    return f'{100 * metres:.2f} cm' if metres >= 0.0005 else f'{1000 * metres:.2f} mm'


def duration(seconds):
    return f'{seconds:.0f} s' if seconds >= 10 else f'{seconds:.1f} s'


def ordinal(n):
    last = 'th' if n % 100 in (11, 12, 13) else {1: 'st', 2: 'nd', 3: 'rd'}.get(n % 10, 'th')
    return f'{n}{last}'


rows = []
for number, argument in enumerate(sys.argv[6:]):
    match = re.fullmatch(r'(.+):([0-9]+)', argument)
    scan, stride = (match[1], int(match[2])) if match else (argument, 1)
    if not os.path.isdir(scan):
        fail(f'{scan}: no such folder')
    name = os.path.basename(os.path.normpath(scan))
    out = os.path.join(results, f'{number}_{name}')
    os.makedirs(out, exist_ok=True)
    print(f'{argument} ...', file=sys.stderr)
    seconds, memory = run([os.path.join(programs, 'bundle_icp_reconstruct'), scan, '-o', out, '-q',
                           '--stride', str(stride)], os.path.join(out, 'reconstruct.log'))
    evaluation = os.path.join(out, 'evaluation.json')
    run([os.path.join(programs, 'bundle_icp_evaluate'), scan, os.path.join(out, 'trajectory.txt'),
         '--json'], evaluation)
    with open(os.path.join(out, 'report.json')) as stream:
        frames = json.load(stream)['frames']
    with open(evaluation) as stream:
        error = json.load(stream)['ate_m']['rmse']
    in_world = sum(frame['registered'] and frame['component'] == 0 for frame in frames)
    label = name + (f', every {ordinal(stride)} frame' if stride > 1 else '')
    rows.append(f'| {label} | {in_world} of {len(frames)} | {length(error)} | {duration(seconds)} '
                f'| {memory / 1e9:.2f} GB |')

print(f'Commit {commit}, {cores} cores ({processor}). The time is that of the whole program, mesh '
      'included.\n')
print('| recording | frames with a pose | ATE (RMSE) | time | peak memory |')
print('| --- | --- | --- | --- | --- |')
print('\n'.join(rows))
PYTHON

#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Kills bundle_icp_reconstruct at random moments (SIGKILL), gives the same command again, and compares poses,
# points and mesh with those of an uninterrupted run. Prints how often they are the same, and the time of
# both runs together over that of one. Fails when one differs.
#
#   bash scripts/kills.sh SCAN [COUNT] [OPTION...]
#
# COUNT of kills, 50 by default; OPTIONs are those of bundle_icp_reconstruct, for example --stride 10. The
# program is that in build/release.
set -euo pipefail
if [ $# -eq 0 ]; then
  echo "Usage: kills.sh SCAN [COUNT] [OPTION...]" >&2
  exit 2
fi
program=$(cd "$(dirname "$0")/.." && pwd)/build/release/bin/bundle_icp_reconstruct
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
python3 - "$program" "$out" "$@" <<'PYTHON'
import filecmp
import os
import random
import shutil
import subprocess
import sys
import time

program, folder, scan, *rest = sys.argv[1:]
count = int(rest.pop(0)) if rest and rest[0].isdigit() else 50
FILES = ['trajectory.txt', 'sparse.ply', 'mesh.ply', 'calibration.json']


def run(out, limit=None):
    """Seconds until the end of the program, or until it was killed."""
    start = time.monotonic()
    process = subprocess.Popen([program, scan, '-o', out, '-q', *rest], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    try:
        code = process.wait(limit)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return time.monotonic() - start
    if code not in (0, 3):
        sys.exit(f'kills.sh: exit code {code}')
    return time.monotonic() - start


whole = os.path.join(folder, 'whole')
one = run(whole)
names = [name for name in FILES if os.path.exists(os.path.join(whole, name))]
random.seed(1)
same, extra = 0, []
for _ in range(count):
    out = os.path.join(folder, 'killed')
    shutil.rmtree(out, ignore_errors=True)
    both = run(out, random.uniform(0, one)) + run(out)
    extra.append(both - one)
    same += all(filecmp.cmp(os.path.join(whole, name), os.path.join(out, name), False)
                for name in names)
extra.sort()
print(f'{same} of {count} the same ({", ".join(names)})')
print(f'one run {one:.1f} s; both together longer by {extra[count // 2]:.1f} s (median), '
      f'{extra[-1]:.1f} s (most)')
sys.exit(same != count)
PYTHON

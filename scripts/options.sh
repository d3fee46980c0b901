#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes docs/options.md from what the programs print with -h.
#
#   bash scripts/options.sh [FOLDER]
#
# FOLDER is where the programs are, default: build/release/bin.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
programs=${1:-$here/build/release/bin}
if [ ! -x "$programs/bundle_icp_reconstruct" ]; then
  echo "options.sh: $programs/bundle_icp_reconstruct is not built" >&2
  exit 1
fi

export LC_ALL=C PYTHONDONTWRITEBYTECODE=1
page=$(mktemp)
trap 'rm -f "$page"' EXIT
python3 - "$programs" >"$page" <<'PYTHON'
import glob
import os
import re
import subprocess
import sys

programs = sys.argv[1]


def joined(text, line):
    """Adds a line of a wrapped description; a word that was cut in two becomes one again."""
    last, first = text.split(' ')[-1], line.split(' ')[0]
    is_cut = re.fullmatch(r'\w+(,\w+)+', last) and re.match(r'\w+,\w', first)
    return text + line if is_cut else f'{text} {line}'.strip()


def take_default(option):
    """Takes the default out of an option: (=VALUE) of its name, or words of its text."""
    match = re.search(r' \(=(.*)\)$', option['name'])
    if match:
        option['name'] = option['name'][:match.start()]
        return f'`{match[1]}`'
    match = re.search(r'[;,] default:? (.+)$', option['text'])
    if match:
        option['text'] = option['text'][:match.start()]
        return match[1]
    if '(required)' in option['text']:
        option['text'] = option['text'].replace(' (required)', '')
        return 'required'
    return 'off' if re.fullmatch(r'(-. \[ )?--\S+( \])?', option['name']) else 'none'


def take_unit(option):
    """Takes the unit out of the text of an option whose value is a number or several."""
    if re.search(r'NAME|FILE|LIST|\.ply', option['name']):
        return ''
    match = re.search(r' ?\[((?:px|m|m\^2|s|1/m|rad)|levels of 255)\]', option['text'])
    if not match:
        return ''
    option['text'] = option['text'][:match.start()] + option['text'][match.end():]
    return match[1]


def print_table(heading, options):
    print(f'\n### {heading}\n\n| option | unit | default | effect |\n| --- | --- | --- | --- |')
    for option in options:
        default, unit = take_default(option), take_unit(option)
        name = re.sub(r'^(-.) \[ (--\S+) \]', r'\1, \2', option['name'])
        cells = [f'`{name}`', unit, default, option['text']]
        print('| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |')


def parse(text):
    """What stands before the options, and the options by heading."""
    lines = text.rstrip().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith('  -')) - 1
    indents = [len(line) - len(line.lstrip()) for line in lines[first:]]
    column = max(set(indents), key=lambda i: (i > 9, indents.count(i)))  # of descriptions
    groups = []
    for line in lines[first:]:
        if line.startswith('  -'):
            is_long = len(line) > column and line[column - 1] != ' '
            name, rest = (line, '') if is_long else (line[:column], line[column:])
            groups[-1][1].append({'name': name.strip(), 'text': rest.strip()})
        elif line.startswith(' '):
            option = groups[-1][1][-1]
            option['text'] = joined(option['text'], line.strip())
        elif line:
            groups.append((line.rstrip(':'), []))
    return '\n'.join(lines[:first]).strip(), groups


def print_program(name, text):
    introduction, groups = parse(text)
    print(f'\n## {name}\n\n```text\n{introduction}\n```')
    for heading, options in groups:
        print_table(heading, options)


print('''# Options

Every option of every program. `bash scripts/options.sh` makes this page from what the programs print with
`-h`. Exit codes: 0 for success, 1 for failure, 2 for wrong usage, 3 for results that were written, but are
doubtful. Results go to files or to the standard output, messages and progress to the error stream.''')
for path in sorted(glob.glob(os.path.join(programs, 'bundle_icp_*'))):
    name = os.path.basename(path)
    if name.startswith('bundle_icp_example_') or not os.access(path, os.X_OK):
        continue
    result = subprocess.run([path, '-h'], capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f'options.sh: {path} -h ended with exit code {result.returncode}')
    print_program(name, result.stdout)
PYTHON
cp "$page" "$here/docs/options.md"
echo "Wrote docs/options.md" >&2

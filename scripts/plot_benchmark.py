#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
# SPDX-FileCopyrightText: 2026 the bundle_icp authors
"""Curves of bundle_icp_benchmark: ATE and share of frames with a pose over the frame rate and over
the share of blurred images, as SCAN_keep.png and SCAN_blur.png beside OUT/benchmark.json. Needs
python3-matplotlib.

  python3 scripts/plot_benchmark.py OUT/benchmark.json
"""
import argparse
import json
import os

import matplotlib
matplotlib.use('Agg')  # no display
import matplotlib.pyplot as plt

# The colour-blind can tell them apart (Okabe and Ito).
COLORS = ['#e69f00', '#56b4e9', '#009e73', '#d55e00', '#0072b2', '#cc79a7', '#f0e442', '#000000']
NEARLY_ALL = 0.9  # with fewer frames the ATE says little: hollow markers
DODGE = 0.06  # between the methods at one step: none hides another


def draw_method(axes, methods, place, color):
    shares = [m['fraction_with_pose'] for m in methods]
    errors = [m['ate_m']['rmse'] if m['ate_m'] else float('nan') for m in methods]
    x = [i + place for i in range(len(methods))]
    for axis, values in zip(axes, (errors, [100 * s for s in shares])):
        axis.plot(x, values, color=color, linewidth=2, label=methods[0]['method'])
        for at, value, share in zip(x, values, shares):
            axis.plot(at, value, 'o', color=color, markersize=8, markeredgewidth=2,
                      markerfacecolor=color if share >= NEARLY_ALL else 'white')


def draw(path, scan, conditions, title, labels):
    figure, axes = plt.subplots(1, 2, figsize=(12.8, 5.8), dpi=100)
    count = len(conditions[0]['methods'])
    for i in range(count):
        draw_method(axes, [c['methods'][i] for c in conditions], DODGE * (i - (count - 1) / 2),
                    COLORS[i % len(COLORS)])
    axes[0].set_yscale('log')
    axes[0].yaxis.set_major_formatter('{x:g}')
    axes[0].yaxis.set_minor_formatter('{x:g}')
    axes[0].set_title('ATE RMSE [m]')
    axes[1].set_ylim(0, 105)
    axes[1].set_title('frames with a pose [%]')
    for axis in axes:
        axis.set_xticks(range(len(labels)), labels)
        axis.set_xlabel(title)
        axis.grid(which='both', color='#e1e1e1')
        axis.set_axisbelow(True)
    figure.suptitle(scan)
    figure.legend(*axes[0].get_legend_handles_labels(), loc='lower center', ncols=4,
                  title='hollow: fewer than 90 % of the frames have a pose', frameon=False)
    figure.tight_layout(rect=(0, 0.05 + 0.05 * ((count + 3) // 4), 1, 1))
    figure.savefig(path)
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('json', metavar='OUT/benchmark.json')
    path = parser.parse_args().json
    with open(path, encoding='utf-8') as file:
        scans = json.load(file)['scans']
    for scan in scans:
        keep = sorted((c for c in scan['conditions'] if c['blur_fraction'] == 0),
                      key=lambda c: c['keep'])
        blur = sorted((c for c in scan['conditions'] if c['keep'] == 1),
                      key=lambda c: c['blur_fraction'])
        prefix = os.path.join(os.path.dirname(path), scan['scan'])
        if len(keep) > 1:
            draw(prefix + '_keep.png', scan['scan'], keep, 'every n-th frame',
                 [c['keep'] for c in keep])
        if len(blur) > 1:
            draw(prefix + '_blur.png', scan['scan'], blur, 'blurred images [%]',
                 [round(100 * c['blur_fraction']) for c in blur])


if __name__ == '__main__':
    main()

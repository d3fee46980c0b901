#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
# SPDX-FileCopyrightText: 2026 the bundle_icp authors
"""Surfaces of simulated scans with full noise, measured against the truth, with those that Open3D's
ScalableTSDFVolume (python3-open3d, if it is there) fuses from the same frames and poses: 5 mm voxels,
4 cm truncation, depth up to 5 m.

  python3 scripts/benchmark_surface.py --bin build/release/bin -o OUT ["--seed 0" "--start 67" ...]

Each scan is named by its options of bundle_icp_simulate. Prints a Markdown table."""
import argparse
import json
import os
import subprocess
import sys

VOXEL, TRUNCATION, MAX_DEPTH = 0.005, 0.04, 5.0
DEPTH_UNITS = 5000.0  # a metre, of simulated scans
LARGEST_GAP = 0.02  # between a frame and its pose [s]


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit('%s failed: %s' % (' '.join(command), done.stderr.strip()))
    return done.stdout


def rows(path):
    with open(path) as file:
        return [line.split() for line in file if line.strip() and not line.startswith('#')]


def write_mesh(path, mesh, np):
    """Open3D itself writes coordinates as double."""
    vertices = np.asarray(mesh.vertices, dtype='<f4')
    faces = np.empty(len(mesh.triangles), dtype=[('n', 'u1'), ('v', '<i4', 3)])
    faces['n'] = 3
    faces['v'] = np.asarray(mesh.triangles)
    with open(path, 'wb') as file:
        file.write(('ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\n'
                    'property float y\nproperty float z\nelement face %d\n'
                    'property list uchar int vertex_indices\nend_header\n'
                    % (len(vertices), len(faces))).encode())
        file.write(vertices.tobytes())
        file.write(faces.tobytes())


def fuse_with_open3d(scan, trajectory, path):
    import numpy as np
    import open3d as o3d
    fx, fy, cx, cy = [float(x) for x in rows(os.path.join(scan, 'intrinsics.txt'))[0][:4]]
    poses = np.array(rows(trajectory), dtype=float)
    fusion = o3d.pipelines.integration
    volume = fusion.ScalableTSDFVolume(voxel_length=VOXEL, sdf_trunc=TRUNCATION,
                                       color_type=fusion.TSDFVolumeColorType.RGB8)
    for (stamp, color), (_, depth) in zip(rows(os.path.join(scan, 'rgb.txt')),
                                          rows(os.path.join(scan, 'depth.txt'))):
        pose = poses[np.argmin(abs(poses[:, 0] - float(stamp)))]
        if abs(pose[0] - float(stamp)) > LARGEST_GAP:
            continue
        world_from_camera = np.eye(4)
        world_from_camera[:3, :3] = o3d.geometry.get_rotation_matrix_from_quaternion(
            [pose[7], pose[4], pose[5], pose[6]])
        world_from_camera[:3, 3] = pose[1:4]
        image = o3d.geometry.RGBDImage.create_from_color_and_depth(
            o3d.io.read_image(os.path.join(scan, color)), o3d.io.read_image(os.path.join(scan, depth)),
            depth_scale=DEPTH_UNITS, depth_trunc=MAX_DEPTH, convert_rgb_to_intensity=False)
        height, width = np.asarray(image.depth).shape
        camera = o3d.camera.PinholeCameraIntrinsic(width, height, fx, fy, cx, cy)
        volume.integrate(image, camera, np.linalg.inv(world_from_camera))
    write_mesh(path, volume.extract_triangle_mesh(), np)


def has_open3d():
    try:
        import open3d  # noqa: F401
    except ImportError:
        print('Open3D is not there (python3-open3d): no comparison', file=sys.stderr)
        return False
    return True


def measure(programs, scan, trajectory, mesh):
    result = json.loads(run(os.path.join(programs, 'bundle_icp_evaluate'), scan, trajectory, '--mesh', mesh,
                            '--surface', os.path.join(scan, 'surface.ply'), '--json'))
    return '%.2f mm, %.2f %%' % (1e3 * result['mesh_m']['mean'], 100 * result['mesh_completeness'])


def benchmark(programs, folder, options, with_open3d):
    base = os.path.join(folder, '_'.join(options.replace('-', '').split()) or 'default')
    scan, out = base + '_scan', base + '_out'
    if not os.path.exists(os.path.join(scan, 'rgb.txt')):
        run(os.path.join(programs, 'bundle_icp_simulate'), scan, '--frames', '60', '--full-noise',
            *options.split())
    truth, estimate = os.path.join(scan, 'groundtruth.txt'), os.path.join(out, 'trajectory.txt')
    run(os.path.join(programs, 'bundle_icp_example_fuse_known_poses'), scan, base + '_true.ply')
    run(os.path.join(programs, 'bundle_icp_reconstruct'), scan, '-o', out, '--quiet')
    for name, trajectory, mesh in (('true', truth, base + '_true.ply'),
                                   ('estimated', estimate, os.path.join(out, 'mesh.ply'))):
        cells = [options, name, measure(programs, scan, trajectory, mesh)]
        if with_open3d:
            peer = base + '_open3d.ply'
            fuse_with_open3d(scan, trajectory, peer)
            cells.append(measure(programs, scan, trajectory, peer))
        print('| ' + ' | '.join(cells) + ' |', flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument('--bin', default='build/release/bin', help='folder of the programs (build/release/bin)')
    parser.add_argument('-o', '--output', required=True, help='folder for scans and meshes')
    parser.add_argument('scans', nargs='*', default=['--seed 0', '--seed 3', '--start 67'],
                        metavar='OPTIONS', help='options of bundle_icp_simulate, one text for each scan')
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)
    with_open3d = has_open3d()
    columns = ['scan', 'poses', 'bundle_icp'] + (['Open3D'] if with_open3d else [])
    print('| ' + ' | '.join(columns) + ' |\n|' + ' --- |' * len(columns))
    for options in arguments.scans:
        benchmark(arguments.bin, arguments.output, options, with_open3d)


if __name__ == '__main__':
    main()

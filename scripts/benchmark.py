#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whole runs of bundle_icp and of its peers on one recording, as a Markdown table.

    scripts/benchmark.py SCAN [--programs build/release/bin] [--stride N] [--max-frames N]
                         [--methods bundle_icp,open3d_odometry,open3d_posegraph,colmap]

SCAN is a TUM RGB-D folder with groundtruth.txt and intrinsics.txt, or one of freiburg1 to 3. Peers
come from the packages python3-open3d and colmap; one that is missing is left out. Each method runs
in a process of its own, whose wall time, CPU time and peak memory are measured. Its poses are
compared with the truth by bundle_icp_evaluate; COLMAP's, which have no scale, after a similarity.
"""
import argparse
import importlib.util
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time

VOXEL, TRUNCATION, MAX_DEPTH = 0.005, 0.04, 3.0  # m; bundle_icp's own voxels, Open3D's usual range
FREIBURG = {'1': (517.3, 516.5, 318.6, 255.3), '2': (520.9, 521.0, 325.1, 249.7),
            '3': (535.4, 539.2, 320.1, 247.6)}


def read_list(path):
    """Lines `stamp value...` of a file, sorted by stamp."""
    with open(path) as file:
        rows = [line.split() for line in file if line.strip() and line[0] != '#']
    return sorted((float(row[0]), row[1:]) for row in rows)


def read_frames(scan, stride, max_frames):
    """(stamp of colour, colour file, depth file), each colour with the nearest depth within 20 ms."""
    depth = read_list(os.path.join(scan, 'depth.txt'))
    frames = []
    for stamp, names in read_list(os.path.join(scan, 'rgb.txt')):
        near = min(depth, key=lambda entry: abs(entry[0] - stamp))
        if abs(near[0] - stamp) <= 0.02:
            frames.append((stamp, os.path.join(scan, names[0]), os.path.join(scan, near[1][0])))
    return frames[::stride][:max_frames]


def read_intrinsics(scan):
    """fx, fy, cx, cy and depth units a metre."""
    path, scale = os.path.join(scan, 'intrinsics.txt'), 5000.0
    if not os.path.exists(path):
        for digit, values in FREIBURG.items():
            if 'freiburg' + digit in os.path.abspath(scan):
                return values, scale
        sys.exit(scan + ': no intrinsics.txt, and not a freiburg recording')
    values = None
    with open(path) as file:
        for words in (line.split() for line in file if line.strip() and line[0] != '#'):
            if words[0] == 'depth_scale':
                scale = float(words[1])
            elif values is None:
                values = tuple(float(word) for word in words[:4])
    return values, scale


def write_trajectory(path, poses):
    """(stamp, 4x4 world_from_camera) in TUM format."""
    import numpy as np
    with open(path, 'w') as file:
        for stamp, pose in poses:
            r = pose[:3, :3]
            # The quaternion is the eigenvector of largest eigenvalue (Bar-Itzhack 2000).
            k = np.array([[r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
                          [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
                          [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], 0],
                          [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)]])
            q = np.linalg.eigh(k)[1][:, -1]  # reads the lower triangle
            print(stamp, *pose[:3, 3], *q, file=file)


class Open3D:
    """Poses by RGB-D odometry from frame to frame, then a mesh by ScalableTSDFVolume."""

    def __init__(self, args):
        import numpy
        import open3d
        self.np, self.o3d = numpy, open3d
        self.frames = read_frames(args.scan, args.stride, args.max_frames)
        (fx, fy, cx, cy), self.scale = read_intrinsics(args.scan)
        height, width = numpy.asarray(open3d.io.read_image(self.frames[0][1])).shape[:2]
        self.camera = open3d.camera.PinholeCameraIntrinsic(width, height, fx, fy, cx, cy)

    def image(self, index, gray):
        _, color, depth = self.frames[index]
        return self.o3d.geometry.RGBDImage.create_from_color_and_depth(
            self.o3d.io.read_image(color), self.o3d.io.read_image(depth), depth_scale=self.scale,
            depth_trunc=MAX_DEPTH, convert_rgb_to_intensity=gray)

    def odometry(self, source, target, guess):
        module = self.o3d.pipelines.odometry
        return module.compute_rgbd_odometry(source, target, self.camera, guess,
                                            module.RGBDOdometryJacobianFromHybridTerm(),
                                            module.OdometryOption())

    def chain(self):
        """World from camera of each frame, and what joined it to the one before."""
        poses, steps, before = [self.np.eye(4)], [], self.image(0, True)
        for index in range(1, len(self.frames)):
            image = self.image(index, True)
            _, step, information = self.odometry(image, before, self.np.eye(4))
            steps.append((step, information))
            poses.append(poses[-1] @ step)
            before = image
        return poses, steps

    def close_loops(self, poses, steps, interval=10, radius=0.7):
        """Multiway registration: every `interval`-th frame against the other ones near it."""
        registration = self.o3d.pipelines.registration
        graph = registration.PoseGraph()
        for pose in poses:
            graph.nodes.append(registration.PoseGraphNode(pose))
        for index, (step, information) in enumerate(steps):
            graph.edges.append(registration.PoseGraphEdge(index + 1, index, step, information, False))
        keys = range(0, len(poses), interval)
        images = {index: self.image(index, True) for index in keys}
        for i in keys:
            for j in keys:
                guess = self.np.linalg.inv(poses[i]) @ poses[j]
                if j <= i + interval or self.np.linalg.norm(guess[:3, 3]) > radius:
                    continue
                success, step, information = self.odometry(images[j], images[i], guess)
                if success:
                    graph.edges.append(registration.PoseGraphEdge(j, i, step, information, True))
        registration.global_optimization(
            graph, registration.GlobalOptimizationLevenbergMarquardt(),
            registration.GlobalOptimizationConvergenceCriteria(),
            registration.GlobalOptimizationOption(max_correspondence_distance=0.03,
                                                  edge_prune_threshold=0.25, reference_node=0))
        return [node.pose for node in graph.nodes]

    def mesh(self, poses, path):
        integration = self.o3d.pipelines.integration
        volume = integration.ScalableTSDFVolume(voxel_length=VOXEL, sdf_trunc=TRUNCATION,
                                                color_type=integration.TSDFVolumeColorType.RGB8)
        for index, pose in enumerate(poses):
            volume.integrate(self.image(index, False), self.camera, self.np.linalg.inv(pose))
        self.o3d.io.write_triangle_mesh(path, volume.extract_triangle_mesh())

    def run(self, out, with_loops):
        poses, steps = self.chain()
        if with_loops:
            poses = self.close_loops(poses, steps)
        write_trajectory(os.path.join(out, 'trajectory.txt'),
                         [(frame[0], pose) for frame, pose in zip(self.frames, poses)])
        self.mesh(poses, os.path.join(out, 'mesh.ply'))


def run_colmap(args, out):
    """Sparse reconstruction of the colour images, without scale: no depth, no mesh."""
    import numpy as np
    images, database, sparse = (os.path.join(out, name) for name in ('images', 'database.db', 'sparse'))
    os.makedirs(images)
    os.makedirs(sparse)
    stamps = {}
    for index, (stamp, color, _) in enumerate(read_frames(args.scan, args.stride, args.max_frames)):
        name = '%06d%s' % (index, os.path.splitext(color)[1])
        os.symlink(os.path.abspath(color), os.path.join(images, name))
        stamps[name] = stamp
    camera = ','.join(str(value) for value in read_intrinsics(args.scan)[0])
    common = ['--database_path', database]
    environment = dict(os.environ, QT_QPA_PLATFORM='offscreen')

    def colmap(*words):
        subprocess.run(['colmap', *words], check=True, stdout=subprocess.DEVNULL, env=environment)

    colmap('feature_extractor', *common, '--image_path', images, '--SiftExtraction.use_gpu', '0',
           '--ImageReader.camera_model', 'PINHOLE', '--ImageReader.single_camera', '1',
           '--ImageReader.camera_params', camera)
    colmap('exhaustive_matcher' if len(stamps) <= 100 else 'sequential_matcher', *common,
           '--SiftMatching.use_gpu', '0')
    colmap('mapper', *common, '--image_path', images, '--output_path', sparse)
    models = []
    for model in sorted(os.listdir(sparse)):
        folder = os.path.join(sparse, model)
        colmap('model_converter', '--input_path', folder, '--output_path', folder, '--output_type', 'TXT')
        with open(os.path.join(folder, 'images.txt')) as file:
            models.append([line.split() for line in file if line[0] != '#'][::2])
    poses = []
    for row in max(models, key=len):
        w, x, y, z = (float(value) for value in row[1:5])
        rotation = np.array(
            [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
             [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
        pose = np.eye(4)
        pose[:3, :3] = rotation.T
        pose[:3, 3] = -rotation.T @ [float(value) for value in row[5:8]]
        poses.append((stamps[row[9]], pose))
    poses = scaled_to_truth(sorted(poses, key=lambda entry: entry[0]), args.scan)
    write_trajectory(os.path.join(out, 'trajectory.txt'), poses)


def scaled_to_truth(poses, scan):
    """With the scale that fits the true positions best (Umeyama 1991): all that COLMAP can be told."""
    import numpy as np
    truth = read_list(os.path.join(scan, 'groundtruth.txt'))
    stamps = np.array([entry[0] for entry in truth])
    places = np.array([[float(value) for value in entry[1][:3]] for entry in truth])
    nearest = [int(np.argmin(abs(stamps - stamp))) for stamp, _ in poses]
    x = np.array([pose[:3, 3] for _, pose in poses])
    y = places[nearest]
    x, y = x - x.mean(0), y - y.mean(0)
    u, d, v = np.linalg.svd(y.T @ x)
    d[2] *= np.sign(np.linalg.det(u) * np.linalg.det(v))
    for _, pose in poses:
        pose[:3, 3] *= d.sum() / (x * x).sum()
    return poses


def run_bundle_icp(args, out):
    subprocess.run([os.path.join(args.programs, 'bundle_icp_reconstruct'), args.scan, '-o', out, '-q',
                    '--stride', str(args.stride), '--max-frames', str(args.max_frames)],
                   check=True, stdout=subprocess.DEVNULL)


METHODS = {'bundle_icp': run_bundle_icp,
           'open3d_odometry': lambda args, out: Open3D(args).run(out, False),
           'open3d_posegraph': lambda args, out: Open3D(args).run(out, True),
           'colmap': run_colmap}


def is_there(method):
    if method.startswith('open3d'):
        return importlib.util.find_spec('open3d') is not None
    return method != 'colmap' or shutil.which('colmap') is not None


def measure(args, method, out):
    """Runs a method in a child of its own, whose children count as well."""
    os.makedirs(out)
    start = time.monotonic()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            METHODS[method](args, out)
            code = 0
        except Exception as error:  # the parent goes on with the next method
            print('%s: %s' % (method, error), file=sys.stderr)
        # Largest of the process and of any of its children [KiB].
        peaks = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        with open(os.path.join(out, 'usage.json'), 'w') as file:
            json.dump({'peak': 1024 * max(usage.ru_maxrss for usage in peaks),
                       'cpu': sum(usage.ru_utime + usage.ru_stime for usage in peaks)}, file)
        sys.stderr.flush()
        os._exit(code)
    _, status = os.waitpid(child, 0)
    with open(os.path.join(out, 'usage.json')) as file:
        usage = json.load(file)
    return status == 0, time.monotonic() - start, usage


def evaluate(args, out):
    result = subprocess.run([os.path.join(args.programs, 'bundle_icp_evaluate'), args.scan,
                             os.path.join(out, 'trajectory.txt'), '--json'],
                            capture_output=True, text=True)
    if result.returncode != 0:
        print(result.stderr, file=sys.stderr, end='')
        return None
    return json.loads(result.stdout)


def print_stages(out):
    path = os.path.join(out, 'report.json')
    if os.path.exists(path):
        with open(path) as file:
            stages = json.load(file)['timing_s']
        print('\nbundle_icp by stage: ' +
              ', '.join('%s %.1f s' % (stage, seconds) for stage, seconds in stages.items()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument('scan')
    parser.add_argument('--programs', default='build/release/bin', help='folder of bundle_icp_*')
    parser.add_argument('--stride', type=int, default=1, help='every N-th frame')
    parser.add_argument('--max-frames', type=int, default=1000000)
    parser.add_argument('--methods', default=','.join(METHODS))
    args = parser.parse_args()
    unknown = set(args.methods.split(',')) - set(METHODS)
    if unknown:
        parser.error('unknown methods: ' + ', '.join(sorted(unknown)))
    if not os.path.exists(os.path.join(args.programs, 'bundle_icp_reconstruct')):
        parser.error(args.programs + ': no bundle_icp_reconstruct; see --programs')
    print('| method | frames with a pose | ATE RMSE | wall | CPU | peak memory |')
    print('| --- | --- | --- | --- | --- | --- |')
    with tempfile.TemporaryDirectory() as scratch:
        for method in args.methods.split(','):
            if not is_there(method):
                print('%s is not installed' % method, file=sys.stderr)
                continue
            out = os.path.join(scratch, method)
            done, wall, usage = measure(args, method, out)
            scores = evaluate(args, out) if done else None
            poses = len(read_list(os.path.join(out, 'trajectory.txt'))) if done else 0
            ate = '%.2f cm' % (100 * scores['ate_m']['rmse']) if scores else 'failed'
            print('| %s | %d | %s | %.1f s | %.1f s | %.2f GB |' %
                  (method, poses, ate, wall, usage['cpu'], usage['peak'] / 1e9), flush=True)
        print_stages(os.path.join(scratch, 'bundle_icp'))


if __name__ == '__main__':
    main()

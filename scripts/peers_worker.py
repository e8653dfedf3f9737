"""One of the peers of scripts/peers in its virtual environment: renders and differentiates when it is asked to.

usage: peers_worker.py NAME PROBLEM
PROBLEM is JSON of scripts/peers. Each line of standard input, {"size": N, "gradient": true, "image": "file.npy"}, is
answered by {"ms": …} or {"error": "…"}. An image is rendered in strips of PROBLEM's rays. The gradient is that of a
scalar (the image times a fixed one) by a twist of six parameters, by the project's own means: torch's autograd.
"""
import importlib.metadata
import json
import math
import sys
import time

import nibabel
import numpy
import torch

# Attenuation as this project makes it of Hounsfield units: docs/formats.md.
WATER_PER_MM, THRESHOLD_HU = 0.02, -800.0


class Problem:
    def __init__(self, told):
        self.told = told
        file = nibabel.load(told['ct'])
        hu = numpy.asarray(file.dataobj, dtype=numpy.float32)
        mu = numpy.where(hu < THRESHOLD_HU, 0, WATER_PER_MM * (1 + hu / 1000))
        self.mu = torch.from_numpy(numpy.ascontiguousarray(mu, dtype=numpy.float32))
        self.affine = torch.from_numpy(file.affine).double()  # Indices to RAS, mm.
        lps_from_ras = torch.diag(torch.tensor([-1.0, -1, 1, 1], dtype=torch.float64))
        T_camera_ras = torch.tensor(told['T_camera_lps'], dtype=torch.float64) @ lps_from_ras
        self.T_ras_camera = T_camera_ras.inverse().float()
        self.sdd = told['source_detector_mm']

    def pixel_mm(self, size):
        return self.told['detector_mm'] / size

    def targets(self, size):
        """Centres of the detector's pixels in the camera, row by row, mm."""
        steps = (torch.arange(size) - (size - 1) / 2) * self.pixel_mm(size)
        y, x = torch.meshgrid(steps, steps, indexing='ij')
        return torch.stack([x, y, torch.full_like(x, self.sdd)], dim=-1)


def twisted(T_ras_camera, twist):
    """The pose moved by a twist in the camera, differentiable at zero."""
    wx, wy, wz, x, y, z = twist
    zero = torch.zeros_like(wx)
    rows = [[zero, -wz, wy, x], [wz, zero, -wx, y], [-wy, wx, zero, z], [zero] * 4]
    return T_ras_camera @ torch.linalg.matrix_exp(torch.stack([torch.stack(row) for row in rows]))


class Nanodrr:
    package = 'nanodrr'

    def __init__(self, problem):
        import torchio
        from nanodrr.camera import make_k_inv
        from nanodrr.data import Subject
        from nanodrr.drr.renderer import _make_src, _make_tgt, render
        self.problem, self.render = problem, render
        self.make_k_inv, self.make_source, self.make_targets = make_k_inv, _make_src, _make_tgt
        image = torchio.ScalarImage(tensor=problem.mu[None], affine=problem.affine.numpy())
        self.subject = Subject.from_images(image, convert_to_mu=False)

    def strip(self, size, T_ras_camera, first, rows):
        pixel = self.problem.pixel_mm(size)
        k_inv = self.make_k_inv(self.problem.sdd, pixel, pixel, 0.0, 0.0, size, size)
        sdd = torch.tensor([self.problem.sdd])
        target = self.make_targets(k_inv, sdd, size, size, k_inv.device, k_inv.dtype)
        target = target[:, first * size:(first + rows) * size]
        source = self.make_source(False, target, sdd)
        return self.render(self.subject, k_inv, T_ras_camera[None], sdd, rows, size, self.problem.told['samples'], False,
                           False, source, target, 'torch')[0, 0]


class Diffdrr:
    """The renderers themselves: the module around them only makes the rays, in conventions of its own."""
    package = 'diffdrr'

    def __init__(self, problem):
        self.problem, self.more = problem, {}
        self.index_from_ras = problem.affine.inverse().float()

    def strip(self, size, T_ras_camera, first, rows):
        targets = self.problem.targets(size)[first:first + rows].reshape(-1, 3)
        T = self.index_from_ras @ T_ras_camera
        source, target = T[:3, 3].reshape(1, 1, 3), (targets @ T[:3, :3].T + T[:3, 3])[None]
        length = targets.norm(dim=-1)[None, None]
        return self.renderer(self.problem.mu, source, target, length, **self.more).reshape(rows, size)


class DiffdrrSiddon(Diffdrr):
    def __init__(self, problem):
        super().__init__(problem)
        from diffdrr.renderers import Siddon
        self.renderer = Siddon()


class DiffdrrTrilinear(Diffdrr):
    def __init__(self, problem):
        super().__init__(problem)
        from diffdrr.renderers import Trilinear
        self.renderer, self.more = Trilinear(), {'n_points': problem.told['samples']}


class Flashdrr:
    package = 'flashdrr'

    def __init__(self, problem):
        from flashdrr.rendering import VolumeRaycaster
        self.problem, self.make = problem, VolumeRaycaster
        self.volume = problem.mu[None, None]
        # It numbers voxels by their centres (0 … n - 1), and then reads between their edges: the whole CT is drawn n/(n - 1)
        # times too large and half a voxel off. Told like this, it draws what the others do.
        shrink = 1 - 1 / torch.tensor(problem.mu.shape, dtype=torch.float64)
        by_edges = torch.diag(torch.cat([shrink, torch.ones(1, dtype=torch.float64)]))
        by_edges[:3, 3] = 0.5 * shrink
        self.index_from_ras = (by_edges @ problem.affine.inverse()).float()
        self.casters = {}

    def caster(self, size):
        """Its camera is a field of view between the centres of the outer pixels."""
        if size not in self.casters:
            half = (size - 1) / 2 * self.problem.pixel_mm(size)
            made = self.make(ray_samples=self.problem.told['samples'], resolution=size, return_tau=True,
                             fov=2 * math.degrees(math.atan2(half, self.problem.sdd)))
            self.casters[size] = made, made.dirs_cam
        return self.casters[size]

    def strip(self, size, T_ras_camera, first, rows):
        caster, rays = self.caster(size)
        caster.dirs_cam, caster.h = rays[first:first + rows], rows
        right_up_forward = torch.diag(torch.tensor([1.0, -1, 1, 1]))
        view = (T_ras_camera @ right_up_forward)[None]
        return caster(self.volume, view, self.index_from_ras, tile_h=size, tile_w=size)[0, 0]


PEERS = {'nanodrr': Nanodrr, 'diffdrr_siddon': DiffdrrSiddon, 'diffdrr_trilinear': DiffdrrTrilinear, 'flashdrr': Flashdrr}


def strips(size, rays):
    rows = max(1, min(size, rays // size))
    return [(first, min(rows, size - first)) for first in range(0, size, rows)]


def drr(peer, problem, size):
    with torch.no_grad():
        return torch.cat([peer.strip(size, problem.T_ras_camera, *strip) for strip in strips(size, problem.told['rays'])])


def gradient(peer, problem, size):
    twist = torch.zeros(6, requires_grad=True)
    weight = problem.targets(size)[..., 0] / problem.told['detector_mm']
    for first, rows in strips(size, problem.told['rays']):
        image = peer.strip(size, twisted(problem.T_ras_camera, twist), first, rows)
        (image * weight[first:first + rows]).sum().backward()
    return twist.grad


def answer(peer, problem, asked):
    start = time.perf_counter()
    made = (gradient if asked['gradient'] else drr)(peer, problem, asked['size'])
    milliseconds = 1000 * (time.perf_counter() - start)
    if not bool(torch.isfinite(made).all()) or float(made.abs().max()) == 0:
        return {'error': 'the result is not finite, or zero'}
    if 'image' in asked:
        numpy.save(asked['image'], made.numpy())
    return {'ms': milliseconds}


def main():
    name, told = sys.argv[1], json.loads(sys.argv[2])
    torch.set_num_threads(told['threads'])
    out, sys.stdout = sys.stdout, sys.stderr  # What the packages print must not stand among the answers.

    def say(what):
        print(json.dumps(what), file=out, flush=True)

    try:
        problem = Problem(told)
        peer = PEERS[name](problem)
        version = importlib.metadata.version
        say({'version': '%s %s (torch %s)' % (peer.package, version(peer.package), torch.__version__)})
    except Exception as error:  # Whatever it is: it is named in the table.
        say({'error': '%s: %s' % (type(error).__name__, error)})
        return
    for line in sys.stdin:
        try:
            say(answer(peer, problem, json.loads(line)))
        except (RuntimeError, MemoryError) as error:
            say({'error': str(error).splitlines()[0]})


if __name__ == '__main__':
    main()

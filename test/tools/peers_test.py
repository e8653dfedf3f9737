#!/usr/bin/python3
"""scripts/peers: where it puts the camera, what it leaves out, and what its table says. Nothing is installed or timed."""
import importlib.machinery
import importlib.util
import os
import struct
import sys
import tempfile
import types
import unittest

import numpy

SCRIPTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'scripts')
sys.path.insert(0, SCRIPTS)
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader('peers', os.path.join(SCRIPTS, 'peers'))
peers = importlib.util.module_from_spec(importlib.util.spec_from_loader('peers', loader))
loader.exec_module(peers)


def write_nifti(path, size, rows, sform=2):
    header = bytearray(352)
    struct.pack_into('<i', header, 0, 348)
    struct.pack_into('<4h', header, 40, 3, *size)
    struct.pack_into('<h', header, 254, sform)
    struct.pack_into('<12f', header, 280, *numpy.ravel(rows))
    with open(path, 'wb') as file:
        file.write(header)


class Geometry(unittest.TestCase):
    def test_the_ct_stands_in_the_middle_of_the_image(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'ct.nii')
            write_nifti(path, (11, 21, 31), [[1, 0, 0, -5], [0, 2, 0, 100], [0, 0, 3, 7]])
            pose, centre = peers.lateral_pose(path)
            numpy.testing.assert_allclose(centre, [0, -120, 52])  # RAS (0, 120, 52) is LPS (0, -120, 52).
            numpy.testing.assert_allclose((pose @ [*centre, 1])[:3], [0, 0, peers.SOURCE_CENTRE_MM], atol=1e-9)
            numpy.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, numpy.eye(3), atol=1e-12)
            self.assertAlmostEqual(numpy.linalg.det(pose[:3, :3]), 1)
            self.assertLess(pose[1, 2], -0.9, 'the head is up in the image: rows run to the feet')

    def test_a_file_without_sform_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'ct.nii')
            write_nifti(path, (2, 2, 2), numpy.eye(4)[:3], sform=0)
            with self.assertRaisesRegex(SystemExit, 'sform'):
                peers.lateral_pose(path)


class Table(unittest.TestCase):
    def setUp(self):
        self.times = peers.Times()
        self.ours = types.SimpleNamespace(title='here', version='a device')
        self.slow = types.SimpleNamespace(title='slow', name='slow', version='slow 1', why_not='', kinds=('drr', 'gradient'))

    def test_what_would_take_too_long_is_left_out(self):
        self.times.add('slow', 128, 'drr', 1000.0)
        self.assertFalse(self.times.too_long('slow', 1024, 'drr'))  # 64 s.
        self.times.add('slow', 128, 'gradient', 4000.0)
        self.assertTrue(self.times.too_long('slow', 1024, 'gradient'))  # 256 s.
        self.assertIn('256 s', self.times.notes['slow', 1024, 'gradient'])
        self.times.add('slow', 1024, 'drr', 64000.0)
        self.assertTrue(self.times.too_long('slow', 1024, 'drr'), 'long ones run once')

    def test_ratios_and_names_of_what_is_missing(self):
        for _ in range(3):
            self.times.add('here', 128, 'drr', 2.0)
            self.times.add('here', 128, 'gradient', 4.0)
            self.times.add('slow', 128, 'drr', 500.0)
        self.times.notes['slow', 128, 'gradient'] = 'left out: about 200 s'
        made = peers.peers_table(self.ours, [self.slow], {'flashdrr': 'could not be installed (pip.txt)'}, [128], self.times)
        self.assertIn('| 128² | slow | 500 (250 ×) | left out: about 200 s | 3 |', made)
        self.assertIn('flashdrr: could not be installed (pip.txt).', made)


if __name__ == '__main__':
    unittest.main()

#!/usr/bin/python3
"""The tool `calibrate` as a user runs it: on a picture of beads that is made here, and on the real grids when
XRAY_REGISTRATION_DATA names the folder of the recorded data (else that part counts as skipped and says why).

usage: calibrate_test.py --tools FOLDER --work FOLDER
"""
import argparse
import math
import os
import struct
import sys
import unittest

import tool_case

SIZE = 300
PITCH = 14.0
TWIST_PX = 8.0


def straight(u, v):
    """Where a pixel of the S-shaped picture belongs, from the middle."""
    x, y = u - (SIZE - 1) / 2, v - (SIZE - 1) / 2
    angle = -(x * x + y * y) / (SIZE / 2) ** 2 * TWIST_PX / (SIZE / 2)
    return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y


def beads(u, v):
    x, y = straight(u, v)
    from_mark = math.hypot(x - PITCH * round(x / PITCH), y - PITCH * round(y / PITCH))
    return int(20000 * (1 - 0.7 / (1 + math.exp(2.0 * (from_mark - 0.27 * PITCH)))))


def write_pgm(path, value):
    """16 bits, as a detector's picture."""
    pixels = [value(u, v) for v in range(SIZE) for u in range(SIZE)]
    with open(path, 'wb') as file:
        file.write(b'P5\n%d %d\n65535\n' % (SIZE, SIZE))
        file.write(struct.pack('>%dH' % len(pixels), *pixels))


class CalibrateTest(tool_case.ToolTest):
    @classmethod
    def setUpClass(cls):
        write_pgm(cls.work('beads.pgm'), beads)

    def refused(self, code, *words):
        """The one line that a call ends with."""
        error = self.tool('calibrate', *words, expect=code)[1]
        self.assertEqual(error.count('\n'), 1, error)
        return error

    def test_map_picture_and_numbers(self):
        output = self.work('new/folder')
        said = self.tool('calibrate', '--grid', self.work('beads.pgm'), '--output', output, '--json', self.work('grid.json'),
                         '--spacing-mm', 7)[0]
        grid = self.report('grid.json')['grid']
        self.assertEqual((grid['image'], grid['image_width'], grid['image_height']), ('beads.pgm', SIZE, SIZE))
        self.assertEqual((grid['kind'], grid['bright_marks']), ('square', False))
        self.assertAlmostEqual(grid['pitch_px'], PITCH, delta=0.02)
        self.assertAlmostEqual(grid['pixel_mm'], 7 / PITCH, delta=0.001)
        # 21 × 21 marks but for the rim.
        self.assertGreater(grid['used'], 330)
        self.assertGreaterEqual(grid['marks'], grid['used'])
        # At the corner of the square of marks the S-shape is 2^1.5 times what it is at the border.
        self.assertGreater(grid['before']['max_px'], 0.7 * TWIST_PX)
        self.assertLess(grid['after']['rms_px'], 0.1)
        self.assertLess(grid['after']['max_px'], 0.5)
        self.assertLess(grid['cross_validated_rms_px'], 0.15)
        self.assertGreater(grid['known_share'], 0.7)
        self.check_is_png('new/folder/grid.png')
        with open(os.path.join(output, 'undistortion_map.yaml')) as file:
            self.assertIn('image_width: %d' % SIZE, file.read())
        for number in ('%.3f' % grid['pitch_px'], '%.3f' % grid['before']['rms_px'], '%.3f' % grid['after']['rms_px'],
                       '%d marks used' % grid['used'], '%.5f mm' % grid['pixel_mm'], 'undistortion_map.yaml', 'grid.png'):
            self.assertIn(number, said)

    def test_a_map_of_another_detector_is_the_frames_reason(self):
        self.tool('calibrate', '--grid', self.work('beads.pgm'), '--output', self.work('map'))
        self.make_session(1)
        with open(self.work('config.yaml'), 'w') as file:
            file.write('image: {undistortion_map: %s}\n' % self.work('map/undistortion_map.yaml'))
        self.tool('register_bag', '--ct', self.work('head.nii.gz'), '--bag', self.work('session.bag'), '--views',
                  'ap,oblique', '--initial-pose-topic', '/ap/ground_truth', '--config', self.work('config.yaml'), '--output',
                  self.work('out.bag'), '--json', self.work('out.json'))
        reason = self.report('out.json')['frames'][0]['reason']
        for words in '128 × 128', '300 × 300', 'image/undistortion_map':
            self.assertIn(words, reason)

    def test_help(self):
        self.assertIn('--grid', self.tool('calibrate', '--help')[0])

    def test_refusals(self):
        write_pgm(self.work('plain.pgm'), lambda u, v: 20000 + u)
        with open(self.work('words.png'), 'w') as file:
            file.write('words')
        output = self.work('none')
        self.assertIn('--grid is required', self.refused(2, '--output', output))
        self.assertIn('--output is required', self.refused(2, '--grid', self.work('beads.pgm')))
        self.assertIn('nowhere.png', self.refused(2, '--grid', self.work('nowhere.png'), '--output', output))
        self.assertIn('--spacing-mm', self.refused(2, '--grid', self.work('beads.pgm'), '--output', output,
                                                   '--spacing-mm', '0'))
        self.assertIn('--json', self.refused(2, '--grid', self.work('beads.pgm'), '--output', output, '--json',
                                             self.work('no/folder/a.json')))
        error = self.refused(1, '--grid', self.work('words.png'), '--output', output)
        self.assertIn('words.png', error)
        self.assertIn('no DICOM, PNG, TIFF or PGM', error)
        error = self.refused(1, '--grid', self.work('plain.pgm'), '--output', output)
        self.assertIn('plain.pgm', error)
        self.assertIn('no regular grid', error)
        self.assertFalse(os.path.exists(output), 'what is refused writes nothing')
        # A file stands where the folder is to be.
        self.assertIn('words.png', self.refused(1, '--grid', self.work('beads.pgm'), '--output', self.work('words.png')))

    def test_real_grids(self):
        data = os.environ.get('XRAY_REGISTRATION_DATA')
        if not data:
            self.skipTest('XRAY_REGISTRATION_DATA does not name the recorded data')
        for name in 'centred', 'orbit30':
            self.tool('calibrate', '--grid', os.path.join(data, 'xray_dicom/siemens_arcadis_grid_%s.dcm' % name), '--output',
                      self.work(name), '--json', self.work(name + '.json'))
            grid = self.report(name + '.json')['grid']
            self.assertEqual((grid['kind'], grid['bright_marks']), ('hexagonal', True))
            self.assertGreater(grid['before']['max_px'], 10.0)
            self.assertLess(grid['after']['rms_px'], 0.25)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    tool_case.add_folders(parser)
    sys.exit(tool_case.run(CalibrateTest, parser.parse_args()))

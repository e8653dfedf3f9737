#!/usr/bin/python3
"""The tool `calibrate` as a user runs it: on a picture of beads and on a session that are made here, and on real grids
and recorded sessions when XRAY_REGISTRATION_DATA names the folder of the recorded data (else that part counts as skipped
and says why).

usage: calibrate_test.py --tools FOLDER --work FOLDER
"""
import argparse
import math
import os
import re
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
                  self.work('out.bag'), '--json', self.work('out.json'), expect=1)
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
        self.assertIn('--grid, or --ct and --bag, is required', self.refused(2, '--output', output))
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

    def calibrate_session(self, name, *words):
        """Of the session that make_session made; the report's views."""
        return self.tool('calibrate', '--ct', self.work('head.nii.gz'), '--bag', self.work('session.bag'), '--views',
                         'ap,oblique', '--initial-pose-topic', '/ap/ground_truth', '--output', self.work(name), '--json',
                         self.work(name + '.json'), *words)[0]

    def register(self, bag):
        """Median mTRE against the session's truth, mm, of the frames that are accepted, which are all."""
        self.tool('register_bag', '--ct', self.work('head.nii.gz'), '--bag', bag, '--views', 'ap,oblique',
                  '--initial-pose-topic', '/ap/ground_truth', '--output', self.work('registered.bag'), '--json',
                  self.work('registered.json'))
        frames = self.report('registered.json')['frames']
        self.assertTrue(all(frame['accepted'] for frame in frames), [frame['reason'] for frame in frames])
        return sorted(frame['mtre'] for frame in frames)[len(frames) // 2]

    def test_session_with_a_wrong_focal_length(self):
        self.make_session(4)
        said = self.calibrate_session('focal', '--wrong', 'focal_length:1.02', '--write-bag')
        views = self.report('focal.json')['views']
        self.assertEqual(sorted(views), ['ap', 'oblique'])
        for view in views.values():
            # 128 pixels and voxels of 2.5 mm; the recorded sessions have the goal of 0.1 %.
            self.assertAlmostEqual(1.02 * view['focal_scale'], 1.0, delta=0.002)
            self.assertGreater(view['focal_scale_sigma'], 0.0)
            self.assertNotIn('focal_length', view['undetermined'])
            self.assertEqual(len(view['T_first_view']), 4)
        self.assertEqual(views['ap']['T_first_view'][0], [1, 0, 0, 0])
        for words in "view 'ap'", "view 'oblique'", 'focal length', 'principal point', '4 of 4 frames used', 'calibrated.bag':
            self.assertIn(words, said)
        with open(self.work('focal/ap.yaml')) as file:
            yaml = file.read()
        self.assertIn('image_width: 128', yaml)
        self.assertIn('plumb_bob', yaml)
        first = float(re.search(r'camera_matrix:.*?data: \[([^,]+),', yaml, re.DOTALL).group(1))
        self.assertAlmostEqual(first, views['ap']['fx'], delta=1e-6)
        with open(self.work('focal/views.launch')) as file:
            launch = file.read()
        self.assertEqual(launch.count('static_transform_publisher'), 1)
        self.check_is_png('focal/residual_motion.png')
        # The bag says what was found instead of what was told: the frames are where they were.
        self.assertLess(self.register(self.work('focal/calibrated.bag')), 0.5)

    def test_session_with_a_wrong_relative_pose(self):
        self.make_session(4)
        self.calibrate_session('right')
        self.calibrate_session('pose', '--wrong', 'view_pose:1,2', '--write-bag', '--frames', 3)
        right = self.report('right.json')['views']['oblique']['T_first_view']
        report = self.report('pose.json')
        self.assertEqual(report['frames'], 3)
        found = report['views']['oblique']['T_first_view']
        self.assertGreater(report['views']['oblique']['rotation_sigma_deg'], 0.0)
        turned = math.acos(min(1.0, (sum(right[i][j] * found[i][j] for i in range(3) for j in range(3)) - 1) / 2))
        self.assertLess(math.degrees(turned), 0.15)
        # Voxels of 2.5 mm and 128 pixels; as told it would be 10 mm and more.
        self.assertLess(self.register(self.work('pose/calibrated.bag')), 1.5)

    def test_refusals_of_sessions(self):
        self.make_session(1)
        session = ['--ct', self.work('head.nii.gz'), '--bag', self.work('session.bag'), '--output', self.work('refused')]
        topic = ['--initial-pose-topic', '/ap/ground_truth']
        self.assertIn('no start', self.refused(2, *session))
        self.assertIn('--bag is required', self.refused(2, *session[:2], '--output', self.work('refused')))
        self.assertIn('--ct is required', self.refused(2, *session[2:]))
        self.assertIn('--wrong', self.refused(2, *session, *topic, '--wrong', 'nonsense'))
        self.assertIn('--frames', self.refused(2, *session, *topic, '--frames', 0))
        self.assertIn('--json', self.refused(2, *session, *topic, '--json', self.work('no/folder/a.json')))
        self.assertIn('/nowhere', self.refused(1, *session, '--initial-pose-topic', '/nowhere'))
        self.assertIn('lateral', self.refused(1, *session, *topic, '--views', 'ap,lateral'))
        with open(self.work('far.yaml'), 'w') as file:
            file.write('position: [0.0, 0.0, -0.5]\norientation: [0, 0, 0, 1]\n')
        error = self.refused(1, *session, '--initial-pose', self.work('far.yaml'))
        self.assertIn('session.bag', error)
        self.assertIn('no frame could be registered', error)
        self.assertIn('--initial-pose', error)
        self.assertFalse(os.path.exists(self.work('refused')), 'what is refused writes nothing')

    def test_goals_on_recorded_sessions(self):
        data = os.environ.get('XRAY_REGISTRATION_DATA')
        if not data:
            self.skipTest('XRAY_REGISTRATION_DATA does not name the recorded data')
        for ct, bag in (('ct/pelvis_2mm.nii.gz', 'sessions/pelvis_biplane.bag'),
                        ('ct/head_phantom_0.9mm.nii.gz', 'clinical_size/head_1024_biplane.bag')):
            right = self.recorded(data, ct, bag)
            self.check_goals(right, self.recorded(data, ct, bag, '--wrong', 'focal_length:1.02'), 1.02)
            self.check_goals(right, self.recorded(data, ct, bag, '--wrong', 'principal_point:12,0'), 1.0)
            self.check_goals(right, self.recorded(data, ct, bag, '--wrong', 'view_pose:1,2'), 1.0)
            if 'pelvis' in ct:
                self.check_sigma(right, self.recorded(data, ct, bag, '--wrong', 'focal_length:1.02', '--wrong',
                                                      'principal_point:12,0', '--wrong', 'view_pose:1,2'))

    def recorded(self, data, ct, bag, *words):
        self.tool('calibrate', '--ct', os.path.join(data, ct), '--bag', os.path.join(data, bag), '--views', 'ap,oblique',
                  '--initial-pose-topic', '/ap/ground_truth', '--frames', 4, '--output', self.work('recorded'), '--json',
                  self.work('recorded.json'), *words)
        return self.report('recorded.json')['views']

    def check_goals(self, right, found, focal_scale):
        """Focal length to 0.1 %, principal point to 1 px or said not to be known, relative pose to 0.05° and 0.3 mm
        (half as much again with 4 frames instead of 12). Undisturbed, all is left as it was recorded."""
        for name, view in found.items():
            self.assertAlmostEqual(focal_scale * view['focal_scale'], 1.0, delta=0.001)
            if 'principal_point' in view['undetermined']:
                continue
            self.assertAlmostEqual(view['cx'], right[name]['cx'], delta=1.0)
            self.assertAlmostEqual(view['cy'], right[name]['cy'], delta=1.0)
        a, b = right['oblique']['T_first_view'], found['oblique']['T_first_view']
        turned = math.acos(min(1.0, (sum(a[i][j] * b[i][j] for i in range(3) for j in range(3)) - 1) / 2))
        self.assertLess(math.degrees(turned), 0.05)
        self.assertLess(math.sqrt(sum((a[i][3] - b[i][3]) ** 2 for i in range(3))), 0.45)

    def check_sigma(self, right, found):
        """All of it wrong at once cannot be told apart with voxels of 2 mm: what is not known is said, and σ covers it."""
        for name, view in found.items():
            self.assertIn('principal_point', view['undetermined'])
            self.assertLess(abs(view['cx'] - right[name]['cx']), 3 * view['centre_sigma_px'])
            self.assertLess(abs(view['fx'] / right[name]['fx'] - 1), 3 * view['focal_scale_sigma'])
        a, b = right['oblique']['T_first_view'], found['oblique']['T_first_view']
        self.assertIn('view_pose', found['oblique']['undetermined'])
        off = math.sqrt(sum((a[i][3] - b[i][3]) ** 2 for i in range(3)))
        self.assertLess(off, 3 * found['oblique']['translation_sigma_mm'])

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

#!/usr/bin/python3
"""Runs the tool `evaluate` as a user does and checks what it writes.

usage: evaluate_test.py simulated|recorded --tools FOLDER --work FOLDER
simulated: on a session that simulate_session makes. recorded: on the sessions below $XRAY_REGISTRATION_DATA; exits 77,
which ctest counts as skipped, when that is not set.
"""
import argparse
import json
import os
import subprocess
import sys
import unittest

TRIAL_KEYS = {'start_mtre', 'final_mtre', 'final_inplane', 'accepted', 'solve_ms', 'iterations'}
SKIPPED = 77
arguments = None


def tool(name, *words, expect=0):
    """Runs a tool; its exit code must be `expect`. Returns standard output and error."""
    line = [os.path.join(arguments.tools, name)] + [str(word) for word in words]
    done = subprocess.run(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=280)
    if done.returncode != expect:
        raise AssertionError('%s: exit code %d instead of %d\n%s%s' %
                             (' '.join(line), done.returncode, expect, done.stdout, done.stderr))
    return done.stdout, done.stderr


def work(name):
    return os.path.join(arguments.work, name)


def report(name):
    with open(work(name)) as file:
        return json.load(file)


class Simulated(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        tool('make_phantom', '--phantom', 'head', '--spacing', 2.5, '--output', work('head.nii.gz'))
        tool('simulate_session', '--ct', work('head.nii.gz'), '--views', 'ap:0,oblique:-50', '--frames', 5, '--size',
             128, '--amplitude-deg', 3, '--amplitude-mm', 5, '--output', work('session.bag'))

    def evaluate(self, *words, expect=0):
        return tool('evaluate', '--ct', work('head.nii.gz'), '--bag', work('session.bag'), *words, expect=expect)

    def test_report_table_and_plot(self):
        output, _ = self.evaluate('--views', 'ap', '--trials', 12, '--seed', 3, '--json', work('ap.json'), '--plot',
                                  work('ap.png'))
        made = report('ap.json')
        self.assertEqual(len(made['trials']), 12)
        for trial in made['trials']:
            self.assertLessEqual(TRIAL_KEYS, set(trial))
        self.assertEqual([trial['frame'] for trial in made['trials']], [i % 5 for i in range(12)])
        # The goal on recorded sessions is 95 %; twelve trials allow two failures.
        self.assertGreaterEqual(made['summary']['success_rate'], 10 / 12)
        self.assertEqual(made['summary']['false_acceptances'], 0)
        for words in ('success', 'false acceptance', 'capture range', 'median'):
            self.assertIn(words, output)
        with open(work('ap.png'), 'rb') as file:
            self.assertEqual(file.read(8), b'\x89PNG\r\n\x1a\n')

    def test_same_seed_same_result(self):
        for name, seed in (('once', 5), ('again', 5), ('other', 6)):
            self.evaluate('--views', 'ap', '--trials', 3, '--seed', seed, '--json', work(name + '.json'))
        keys = ('start_mtre', 'final_mtre', 'final_inplane', 'accepted', 'iterations', 'T_camera_ct')
        once, again, other = ([[trial[key] for key in keys] for trial in report(name + '.json')['trials']]
                              for name in ('once', 'again', 'other'))
        self.assertEqual(once, again)
        self.assertNotEqual(once, other)

    def test_two_views(self):
        self.evaluate('--views', 'ap,oblique', '--trials', 6, '--json', work('both.json'))
        summary = report('both.json')['summary']
        self.assertEqual(summary['views'], ['ap', 'oblique'])
        self.assertGreaterEqual(summary['success_rate'], 5 / 6)

    def test_tracking(self):
        output, _ = self.evaluate('--views', 'ap', '--tracking', '--json', work('tracked.json'))
        made = report('tracked.json')
        self.assertEqual(len(made['trials']), 5)
        self.assertEqual(made['trials'][0]['start_mtre'], 0)
        self.assertTrue(all(trial['accepted'] for trial in made['trials']), output)

    def test_no_disturbance_starts_at_the_truth(self):
        self.evaluate('--views', 'ap', '--trials', 1, '--rotation', 0, '--translation', 0, '--json', work('zero.json'))
        # A pose goes through metres and a quaternion in the bag, in double.
        self.assertLess(report('zero.json')['trials'][0]['start_mtre'], 1e-6)

    def test_wrong_arguments(self):
        for words in (['--trials', 0], ['--rotation', -1], ['--method', 'magic'], ['--unknown', 1],
                      ['--json', work('no/such/folder/x.json')]):
            _, error = self.evaluate(*words, expect=2)
            self.assertIn('evaluate', error)
        tool('evaluate', '--ct', work('missing.nii.gz'), '--bag', work('session.bag'), expect=2)

    def test_work_that_fails_says_why(self):
        _, error = self.evaluate('--views', 'lateral', expect=1)
        self.assertIn('lateral', error)
        _, error = tool('evaluate', '--ct', work('session.bag'), '--bag', work('session.bag'), expect=1)
        self.assertIn('session.bag', error)


class Recorded(unittest.TestCase):
    """A small seeded part of docs/accuracy.md; the bounds leave room for a few trials' chance."""

    def check(self, name, ct, bag, words, success, mtre_mm, trials=10):
        data = os.environ['XRAY_REGISTRATION_DATA']
        path = work(name + '.json')
        output, _ = tool('evaluate', '--ct', os.path.join(data, ct), '--bag', os.path.join(data, bag), '--trials',
                         trials, '--seed', 7, '--json', path, *words)
        summary = report(name + '.json')['summary']
        self.assertGreaterEqual(summary['success_rate'], success, output)
        self.assertLessEqual(summary['median_mtre'], mtre_mm, output)
        self.assertEqual(summary['false_acceptances'], 0, output)

    def test_head(self):
        self.check('head', 'ct/head_phantom_0.9mm.nii.gz', 'sessions/head_lateral.bag', [], 0.9, 0.4)

    def test_pelvis_from_both_sides(self):
        self.check('pelvis_both', 'ct/pelvis_2mm.nii.gz', 'sessions/pelvis_biplane.bag', ['--views', 'ap,oblique'], 0.9,
                   0.5)

    def test_pelvis_from_one_side(self):
        self.check('pelvis_ap', 'ct/pelvis_2mm.nii.gz', 'sessions/pelvis_biplane.bag', ['--views', 'ap'], 0.8, 2.0)

    def test_pelvis_with_instrument(self):
        self.check('pelvis_instrument', 'ct/pelvis_2mm.nii.gz', 'sessions/pelvis_ap_instrument.bag', [], 0.7, 2.0)

    def test_wrist(self):
        self.check('wrist', 'wrist/radius.nii.gz', 'wrist/wrist_biplane.bag',
                   ['--rotation', 5, '--translation', 5, '--target-size', 40, '--reference'], 0.8, 0.8, trials=5)

    def test_head_tracked(self):
        data = os.environ['XRAY_REGISTRATION_DATA']
        output, _ = tool('evaluate', '--ct', os.path.join(data, 'ct/head_phantom_0.9mm.nii.gz'), '--bag',
                         os.path.join(data, 'sessions/head_lateral.bag'), '--tracking', '--json', work('tracked.json'))
        self.assertEqual(report('tracked.json')['summary']['accepted_rate'], 1.0, output)


def main():
    global arguments
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('what', choices=['simulated', 'recorded'])
    parser.add_argument('--tools', required=True)
    parser.add_argument('--work', required=True)
    arguments = parser.parse_args()
    if arguments.what == 'recorded' and not os.path.isdir(os.environ.get('XRAY_REGISTRATION_DATA', '')):
        print('skipped: XRAY_REGISTRATION_DATA does not name the folder of recorded sessions')
        return SKIPPED
    os.makedirs(arguments.work, exist_ok=True)
    case = Simulated if arguments.what == 'simulated' else Recorded
    result = unittest.TextTestRunner(verbosity=2).run(unittest.defaultTestLoader.loadTestsFromTestCase(case))
    return 0 if result.wasSuccessful() else 1


if __name__ == '__main__':
    sys.exit(main())

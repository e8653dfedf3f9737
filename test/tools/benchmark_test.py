#!/usr/bin/python3
"""Runs the tool `benchmark` as a user does and checks that every row is there. No time is judged.

usage: benchmark_test.py --tools FOLDER --work FOLDER --has "plots;bags;kernels"
"""
import argparse
import json
import os
import subprocess
import sys
import unittest

ROWS = (['step/paper/cpp/128', 'step/paper/opencl/128', 'step/fast/128', 'step/fast/256', 'drr/fast/200',
         'drr/fast/200/kernel', 'drr/paper/opencl/200', 'upload/256', 'frame/fast/256'] +
        ['registration/table2/%d' % start for start in (2, 4, 6)] +
        ['registration/table2/paper/%s/%d' % (kind, start) for kind in ('cpp', 'opencl') for start in (2, 4, 6)] +
        ['registration/table1/paper/%s/%d' % (kind, n) for kind in ('cpp', 'opencl') for n in (16, 32, 64, 128)])
GROWTH = (['growth/%s/%d/%s' % (what, n, kind) for what in ('ct', 'image') for n in (64, 128, 256)
           for kind in ('step', 'drr')] +
          ['growth/views/%d/%s' % (views, kind) for views in (1, 2, 3, 4) for kind in ('step', 'frame')])
WITH_SAMPLES = ['step/paper/cpp/128', 'step/paper/opencl/128', 'step/fast/128', 'step/fast/256', 'drr/fast/200']
arguments = None


def tool(name, *words, expect=0):
    line = [os.path.join(arguments.tools, name)] + [str(word) for word in words]
    done = subprocess.run(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True, timeout=550)
    if done.returncode != expect:
        raise AssertionError('%s: exit code %d instead of %d\n%s%s' %
                             (' '.join(line), done.returncode, expect, done.stdout, done.stderr))
    return done.stdout, done.stderr


def work(name):
    return os.path.join(arguments.work, name)


def report(name):
    with open(work(name)) as file:
        return json.load(file)


class Benchmark(unittest.TestCase):
    def check_rows(self, rows):
        for name, row in rows.items():
            self.assertGreater(row['milliseconds_median'], 0, name)
            self.assertLessEqual(row['milliseconds_median'], row['milliseconds_p95'], name)
            self.assertLessEqual(row['milliseconds_p95'], row['milliseconds_p99'], name)
            self.assertGreater(row['runs'], 0, name)

    def test_all_rows(self):
        words = ['--quick', '--growth', '--json', work('all.json')]
        if 'plots' in arguments.has:
            words += ['--plot', work('growth.png')]
        output, _ = tool('benchmark', *words)
        made = report('all.json')
        self.assertTrue(made['device'])
        rows = {row['name']: row for row in made['rows']}
        self.assertEqual(len(rows), len(made['rows']), 'two rows of one name')
        self.assertEqual(set(ROWS + GROWTH) - set(rows), set())
        self.check_rows(rows)
        for name in WITH_SAMPLES:
            self.assertGreater(rows[name]['samples_per_second'], 0, name)
        # Rays may meet no more planes than there are, and the head fills a good part of them.
        samples = rows['step/fast/128']['samples_per_second'] * rows['step/fast/128']['milliseconds_median'] * 1e-3
        self.assertLessEqual(samples, 128 ** 3)
        self.assertGreater(samples, 0.1 * 128 ** 3)
        for name in ('registration/table2/2', 'registration/table2/4', 'registration/table2/6'):
            self.assertNotIn('REFUSED', rows[name]['note'])
        # Three ratios and three registrations; memory needs the 512^3 CT that --quick leaves out.
        self.assertGreaterEqual(len(made['goals']), 6)
        self.assertEqual([table['name'] for table in made['paper_tables']], ['table1', 'table2'])
        self.assertEqual(len(made['ceiling']['profiles']), 4)
        for one in made['ceiling']['profiles']:
            for key in ('plan_ms', 'march_ms', 'windows_ms', 'drr_march_ms', 'loads_only_ms', 'samples'):
                self.assertGreater(one[key], 0, key)
        self.assertGreater(made['ceiling']['copy_bytes_per_second'], 0)
        self.assertIn('goal', output)
        if 'plots' in arguments.has:
            with open(work('growth.png'), 'rb') as file:
                self.assertEqual(file.read(8), b'\x89PNG\r\n\x1a\n')

    def test_tracked_frames(self):
        if 'bags' not in arguments.has:
            self.skipTest('this build reads no bags')
        tool('make_phantom', '--phantom', 'head', '--spacing', 2.5, '--output', work('head.nii.gz'))
        tool('simulate_session', '--ct', work('head.nii.gz'), '--views', 'ap:0,oblique:-50', '--frames', 4, '--size', 128,
             '--amplitude-deg', 3, '--amplitude-mm', 5, '--output', work('session.bag'))
        tool('benchmark', '--quick', '--only', 'bag', '--ct', work('head.nii.gz'), '--bag', work('session.bag'),
             '--views', 'ap,oblique', '--json', work('bag.json'))
        rows = {row['name']: row for row in report('bag.json')['rows']}
        self.assertEqual(set(rows), {'tracked_frame/session'})
        self.check_rows(rows)
        self.assertEqual(rows['tracked_frame/session']['runs'], 4)

    def test_wrong_arguments(self):
        for words in (['--only', 'magic'], ['--plot', work('x.png')], ['--bag', __file__], ['--unknown'],
                      ['--json', work('no/such/folder/x.json')]):
            _, error = tool('benchmark', *words, expect=2)
            self.assertIn('benchmark', error)

    def test_no_such_device(self):
        _, error = tool('benchmark', '--device', 'no such device', expect=1)
        self.assertIn('no such device', error)

    def test_kernel_variants(self):
        if 'kernels' not in arguments.has:
            self.skipTest('kernel_benchmark was not built: libbenchmark-dev is missing')
        output, _ = tool('kernel_benchmark', '--benchmark_filter=/64', '--benchmark_format=json',
                         '--benchmark_min_time=0.01')
        names = [one['name'].split('/')[0] for one in json.loads(output[output.index('{'):])['benchmarks']]
        self.assertEqual(set(names), {'step', 'march', 'drr', 'loads_only', 'derivative_images'})
        tool('kernel_benchmark', '--wrong', expect=2)


def main():
    global arguments
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--tools', required=True)
    parser.add_argument('--work', required=True)
    parser.add_argument('--has', default='')
    arguments = parser.parse_args()
    os.makedirs(arguments.work, exist_ok=True)
    result = unittest.TextTestRunner(verbosity=2).run(unittest.defaultTestLoader.loadTestsFromTestCase(Benchmark))
    return 0 if result.wasSuccessful() else 1


if __name__ == '__main__':
    sys.exit(main())

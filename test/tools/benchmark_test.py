#!/usr/bin/python3
"""Runs the tool `benchmark` as a user does and checks that every row is there. No time is judged.

usage: benchmark_test.py --tools FOLDER --work FOLDER --has "bags;kernels"
"""
import argparse
import json
import sys

import tool_case

ROWS = (['step/paper/cpp/128', 'step/paper/opencl/128', 'step/fast/128', 'step/fast/256', 'drr/fast/200',
         'drr/fast/200/kernel', 'drr/paper/opencl/200', 'upload/256', 'frame/fast/256'] +
        ['registration/table2/%d' % start for start in (2, 4, 6)] +
        ['registration/table2/paper/%s/%d' % (kind, start) for kind in ('cpp', 'opencl') for start in (2, 4, 6)] +
        ['registration/table1/paper/%s/%d' % (kind, n) for kind in ('cpp', 'opencl') for n in (16, 32, 64, 128)])
GROWTH = (['growth/%s/%d/%s' % (what, n, kind) for what in ('ct', 'image') for n in (64, 128, 256)
           for kind in ('step', 'drr')] +
          ['growth/views/%d/%s' % (views, kind) for views in (1, 2, 3, 4) for kind in ('step', 'frame')])
WITH_SAMPLES = ['step/paper/cpp/128', 'step/paper/opencl/128', 'step/fast/128', 'step/fast/256', 'drr/fast/200']


class Benchmark(tool_case.ToolTest):
    timeout_s = 550
    has = ''  # What was built.

    def check_rows(self, rows):
        for name, row in rows.items():
            self.assertGreater(row['milliseconds_median'], 0, name)
            self.assertLessEqual(row['milliseconds_median'], row['milliseconds_p95'], name)
            self.assertLessEqual(row['milliseconds_p95'], row['milliseconds_p99'], name)
            self.assertGreater(row['runs'], 0, name)

    def test_all_rows(self):
        output, _ = self.tool('benchmark', '--quick', '--growth', '--json', self.work('all.json'))
        made = self.report('all.json')
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

    def test_tracked_frames(self):
        if 'bags' not in self.has:
            self.skipTest('this build reads no bags')
        self.make_session(frames=4)
        self.tool('benchmark', '--quick', '--only', 'bag', '--ct', self.work('head.nii.gz'), '--bag',
                  self.work('session.bag'), '--views', 'ap,oblique', '--json', self.work('bag.json'))
        rows = {row['name']: row for row in self.report('bag.json')['rows']}
        self.assertEqual(set(rows), {'tracked_frame/session', 'cold_start/session'})
        self.check_rows(rows)
        # One pass: the first frame is a cold start, the others follow it.
        self.assertEqual(rows['tracked_frame/session']['runs'], 3)
        self.assertEqual(rows['cold_start/session']['runs'], 1)

    def test_a_ct_and_cameras(self):
        if 'bags' not in self.has:
            self.skipTest('this build reads no CTs')
        self.make_session(frames=1)
        with open(self.work('pose.yaml'), 'w') as file:
            file.write('T_camera_ct_mm: [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 700], [0, 0, 0, 1]]\n')
        words = []
        for size in (64, 96):
            with open(self.work('camera_%d.yaml' % size), 'w') as file:
                file.write('{width: %d, height: %d, source_detector_mm: 1000, pixel_mm: %g}\n' % (size, size, 400 / size))
            words += ['--camera', self.work('camera_%d.yaml' % size)]
        words += ['--quick', '--only', 'camera', '--ct', self.work('head.nii.gz')]
        self.tool('benchmark', *words, '--pose', self.work('pose.yaml'), '--json', self.work('camera.json'))
        rows = {row['name']: row for row in self.report('camera.json')['rows']}
        self.assertEqual(set(rows), {'%s/camera/%d' % (kind, size) for kind in ('drr', 'drr_gradient', 'drr_derivatives')
                                     for size in (64, 96)})
        self.check_rows(rows)
        for row in rows.values():  # The CT is in the picture.
            self.assertGreater(row['samples_per_second'], 0)
        _, error = self.tool('benchmark', *words, expect=2)
        self.assertIn('--pose', error)

    def test_wrong_arguments(self):
        for words in (['--only', 'magic'], ['--bag', __file__], ['--unknown'],
                      ['--json', self.work('no/such/folder/x.json')]):
            _, error = self.tool('benchmark', *words, expect=2)
            self.assertIn('benchmark', error)

    def test_no_such_device(self):
        _, error = self.tool('benchmark', '--device', 'no such device', expect=1)
        self.assertIn('no such device', error)

    def test_kernel_variants(self):
        if 'kernels' not in self.has:
            self.skipTest('kernel_benchmark was not built: libbenchmark-dev is missing')
        output, _ = self.tool('kernel_benchmark', '--benchmark_filter=/64', '--benchmark_format=json',
                              '--benchmark_min_time=0.01')
        names = [one['name'].split('/')[0] for one in json.loads(output[output.index('{'):])['benchmarks']]
        # By hand where the processor has AVX-512.
        self.assertEqual(set(names) - {'march_by_hand'}, {'step', 'march', 'drr', 'loads_only', 'derivative_images'})
        self.tool('kernel_benchmark', '--wrong', expect=2)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tool_case.add_folders(parser)
    parser.add_argument('--has', default='')
    arguments = parser.parse_args()
    Benchmark.has = arguments.has
    return tool_case.run(Benchmark, arguments)


if __name__ == '__main__':
    sys.exit(main())

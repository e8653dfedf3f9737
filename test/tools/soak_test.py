#!/usr/bin/python3
"""scripts/soak: what it calls growth, its figures by the minute, and how it refuses. A run is scripts/test's."""
import os
import subprocess
import sys
import unittest

SCRIPTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'scripts')
sys.dont_write_bytecode = True
sys.path.insert(0, SCRIPTS)
import soak_rules  # noqa: E402


def samples(rss=lambda s: 300.0, descriptors=lambda s: 20, threads=lambda s: 16, seconds=3600):
    every = list(range(seconds))
    return {'seconds': every, 'rss_mib': [rss(s) for s in every], 'descriptors': [descriptors(s) for s in every],
            'threads': [threads(s) for s in every]}


def grown(made):
    return [name for name, found in soak_rules.growth(made).items() if found['grew']]


class Soak(unittest.TestCase):
    def test_what_stays_is_no_growth(self):
        self.assertEqual(grown(samples()), [])

    def test_what_is_needed_once_is_no_growth(self):
        self.assertEqual(grown(samples(rss=lambda s: 100.0 if s < 600 else 350.0, threads=lambda s: 3 if s < 10 else 16)), [])

    def test_what_comes_and_goes_is_no_growth(self):
        loads = lambda s: 300.0 + (200.0 if s % 60 < 20 else 0.0)
        callers = lambda s: 20 + (5 if s % 30 < 10 else 0)
        self.assertEqual(grown(samples(rss=loads, descriptors=callers, threads=lambda s: 16 + (s % 60 < 20))), [])

    def test_a_leak_is_growth(self):
        self.assertEqual(grown(samples(rss=lambda s: 300.0 + s / 60.0)), ['rss_mib'])  # 1 MiB a minute.
        self.assertEqual(grown(samples(descriptors=lambda s: 20 + s // 300)), ['descriptors'])
        self.assertEqual(grown(samples(threads=lambda s: 16 + s // 900)), ['threads'])

    def test_three_minutes_show_an_image_that_is_lost_each_second(self):
        self.assertEqual(grown(samples(rss=lambda s: 300.0 + s * 0.25, seconds=180)), ['rss_mib'])

    def test_too_short_a_run_says_nothing(self):
        self.assertEqual(soak_rules.growth(samples(seconds=3)), {})

    def test_figures_are_those_of_their_minute(self):
        minutes = soak_rules.Minutes()
        for number in range(100):
            minutes.add(1.0, 'accepted', 1e-3 * (number + 1))
        minutes.add(59.0, 'refused')
        minutes.add(130.0, 'dropped')
        first, second, third = minutes.report()
        self.assertEqual((first['accepted'], first['refused'], first['dropped']), (100, 1, 0))
        self.assertAlmostEqual(first['latency_median_ms'], 50.5)
        self.assertAlmostEqual(first['latency_p99_ms'], 99.0)
        self.assertEqual((second['accepted'], second['latency_p99_ms']), (0, None))
        self.assertEqual(third['dropped'], 1)

    def run_script(self, *words):
        return subprocess.run(['/usr/bin/python3', os.path.join(SCRIPTS, 'soak')] + list(words), stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, universal_newlines=True)

    def test_help_and_refusals(self):
        helped = self.run_script('--help')
        self.assertEqual(helped.returncode, 0)
        self.assertIn('--minutes', helped.stdout)
        for words, said in ((['--minutes', '0'], '--minutes is 0: allowed are 1'), (['--rate', 'fast'], '--rate'),
                            (['--paint'], '--paint')):
            done = self.run_script(*words)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn(said, done.stderr)


if __name__ == '__main__':
    unittest.main(verbosity=2)

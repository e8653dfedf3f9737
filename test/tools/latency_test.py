#!/usr/bin/python3
"""scripts/latency: what its tables say of what the node said. Nothing is launched or timed."""
import importlib.machinery
import importlib.util
import os
import sys
import types
import unittest

SCRIPTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'scripts')
sys.path.insert(0, SCRIPTS)
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader('latency', os.path.join(SCRIPTS, 'latency'))
latency = importlib.util.module_from_spec(importlib.util.spec_from_loader('latency', loader))
loader.exec_module(latency)


class Tables(unittest.TestCase):
    def setUp(self):
        self.script = types.SimpleNamespace(arguments=types.SimpleNamespace(sessions='head_lateral', threads='1,2', rate=30,
                                                                            seconds=10.0))
        self.said = {'1': {'first_s': 2.0, 'sent': 300, 'registered': 200, 'accepted': 199,
                           'ages_s': [0.02] * 198 + [0.05, 0.09]}, '2': {'first_s': None}}
        latency.run = lambda script, name, rate, seconds, environment: self.said[environment['POCL_MAX_PTHREAD_COUNT']]

    def test_ages_are_of_registered_frames_in_milliseconds(self):
        table, raw = latency.ages(self.script)
        rows = table.splitlines()[2:]
        self.assertEqual(rows[0], '| head_lateral | 1 | 30.0 | 20.0 | 199 of 200 | 20.0 | 50.0 |')
        self.assertIn('no pose', rows[1])
        self.assertEqual(raw[0]['threads'], '1')

    def test_ranks(self):
        self.assertEqual(latency.rank([3, 1, 2], 0.5), 2)
        self.assertEqual(latency.rank([3, 1, 2], 0.99), 3)


if __name__ == '__main__':
    unittest.main()

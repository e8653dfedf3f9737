#!/usr/bin/python3
"""scripts/plot_results: the curve that it computes, the pictures that it writes, and how it refuses.

usage: plot_results_test.py FOLDER
"""
import importlib.machinery
import importlib.util
import json
import os
import subprocess
import sys
import unittest

SCRIPT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'scripts', 'plot_results')
CRITERIA = {'max_mtre_mm': 3.0, 'max_inplane_mm': 0.5, 'false_acceptance_mtre_mm': 5.0}


def trial(final_mm, similarity, accepted=True):
    """As `evaluate` reports one; None stands for an infinite error."""
    infinite = final_mm is None
    return {'start_mtre': 8.0, 'final_mtre': final_mm, 'final_inplane': None if infinite else final_mm / 10, 'stamp': 1.0,
            'success': not infinite and final_mm < 3, 'wrong': infinite or final_mm > 5, 'accepted': accepted,
            'similarity': similarity, 'inlier_fraction': similarity, 'condition_number': None if infinite else 100.0}


def report(trials, tracking=False, **more):
    bins = [{'from_mm': 8.0, 'to_mm': 10.0, 'trials': len(trials), 'successes': sum(t['success'] for t in trials)}]
    summary = {'session': 'session', 'views': ['ap', 'oblique'], 'method': 'fast', 'tracking': tracking,
               'criteria': CRITERIA, 'bins': bins}
    return dict({'trials': trials, 'summary': summary}, **more)


MIXED = [trial(0.2, 0.9), trial(20.0, 0.8, False), trial(0.3, 0.7, False), trial(4.0, 0.6), trial(None, 0.1)]


class PlotResults(unittest.TestCase):
    work_folder = ''

    def work(self, name, content=None):
        path = os.path.join(self.work_folder, name)
        if content is not None:
            with open(path, 'w') as file:
                json.dump(content, file)
        return path

    def plot(self, *words, expect=0, environment=None):
        done = subprocess.run([sys.executable, SCRIPT] + list(words), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              universal_newlines=True, env=dict(os.environ, **(environment or {})))
        self.assertEqual(done.returncode, expect, done.stderr)
        return done.stderr

    @staticmethod
    def module():
        # Its name has no ending by which Python would know it.
        loader = importlib.machinery.SourceFileLoader('plot_results', SCRIPT)
        module = importlib.util.module_from_spec(importlib.util.spec_from_loader('plot_results', loader))
        loader.exec_module(module)
        return module

    def curve(self, trials):
        return self.module().operating_curve(trials, lambda one: one['similarity'])

    def test_curve_runs_from_nothing_to_all(self):
        trials = [trial(0.2, 0.9), trial(20.0, 0.8), trial(0.3, 0.7), trial(30.0, 0.1)]
        self.assertEqual(self.curve(trials), [(0, 0), (0, 0.5), (0.5, 0.5), (0.5, 1), (1, 1)])

    def test_equal_cues_pass_together(self):
        self.assertEqual(self.curve([trial(0.2, 0.5), trial(20.0, 0.5)]), [(0, 0), (1, 1)])

    def test_what_is_neither_good_nor_wrong_does_not_count(self):
        self.assertEqual(self.curve([trial(0.2, 0.9), trial(4.0, 0.8), trial(20.0, 0.5)]), [(0, 0), (0, 1), (1, 1)])

    def test_no_curve_when_there_is_nothing_to_tell_apart(self):
        for trials in ([], [trial(0.2, 0.9)], [trial(20.0, 0.9)]):
            self.assertEqual(self.curve(trials), [])

    def is_picture(self, path, start):
        with open(path, 'rb') as file:
            content = file.read()
        self.assertTrue(content.startswith(start), path)
        return content

    def test_evaluation(self):
        convergence = [{'steps': [0, 3], 'mtre': [8.0, 0.2]}, {'steps': [0, 5], 'mtre': [8.0, None]}]
        for name, made in (('mixed', report(MIXED, convergence=convergence)), ('good', report(MIXED[:1])),
                           ('wrong', report(MIXED[-1:])), ('tracked', report(MIXED, tracking=True))):
            self.plot('evaluation', self.work(name + '.png'), self.work(name + '.json', made))
            self.is_picture(self.work(name + '.png'), b'\x89PNG\r\n\x1a\n')

    def test_verdict_over_several_reports(self):
        good, wrong = self.work('one.json', report(MIXED[:1])), self.work('two.json', report(MIXED[1:]))
        self.plot('verdict', self.work('verdict.svg'), good, wrong)
        picture = self.is_picture(self.work('verdict.svg'), b'<?xml')
        self.plot('verdict', self.work('again.svg'), good, wrong)
        self.assertEqual(self.is_picture(self.work('again.svg'), b'<?xml'), picture)
        self.assertIn('no wrong result', self.plot('verdict', self.work('none.svg'), good, expect=1))

    def test_what_is_left_to_move(self):
        left = lambda mm: [{'what': 'other_patient', 'unit': 'mm', 'estimate': mm}]
        right = self.work('right.json', report([dict(trial(0.2, 0.9), suspicions=left(0.02))]))
        wrong = self.work('wrong.json', report([dict(trial(1.2, 0.9), suspicions=left(0.6))], wrong=[{'text': 'bent_ct'}]))
        self.plot('left', self.work('left.svg'), right, wrong)
        self.is_picture(self.work('left.svg'), b'<?xml')
        self.assertIn('nothing', self.plot('left', self.work('none.svg'), self.work('old.json', report(MIXED)), expect=1))

    def test_a_result_from_wrong_inputs_is_never_good(self):
        judged = self.module().judged(report([trial(0.2, 0.9), trial(1.2, 0.8)], wrong=[{'text': 'bent_ct'}]))
        self.assertEqual([(one['success'], one['wrong']) for one in judged], [(False, False), (False, True)])
        self.assertTrue(self.module().judged(report([trial(0.2, 0.9)]))[0]['success'])

    def test_growth(self):
        rows = [{'name': 'growth/%s/%d/%s' % (what, n, kind), 'milliseconds_median': 0.1 * n}
                for what, kinds in (('ct', ('step', 'drr')), ('image', ('step', 'drr')), ('views', ('step', 'frame')))
                for n in ((1, 2) if what == 'views' else (64, 128)) for kind in kinds]
        self.plot('growth', self.work('growth.png'), self.work('growth.json', {'rows': rows}))
        self.is_picture(self.work('growth.png'), b'\x89PNG\r\n\x1a\n')
        self.assertIn('--growth', self.plot('growth', self.work('none.png'), self.work('no.json', {'rows': []}), expect=1))

    def test_soak(self):
        minute = {'accepted': 800, 'refused': 50, 'dropped': 50, 'latency_median_ms': 20.0, 'latency_p99_ms': 90.0}
        silent = dict(minute, accepted=0, latency_median_ms=None, latency_p99_ms=None)
        node = {'samples': {'seconds': [1, 2, 3], 'rss_mib': [300, 301, 301], 'descriptors': [20, 21, 20],
                            'threads': [16, 16, 16]}, 'minutes': [minute, silent, minute]}
        made = {'minutes': 3, 'rate': 15, 'events': {'forget': 2}, 'failures': [], 'nodes': {'one': node, 'two': node}}
        self.plot('soak', self.work('soak.png'), self.work('soak.json', made))
        self.is_picture(self.work('soak.png'), b'\x89PNG\r\n\x1a\n')
        self.assertIn("no 'nodes'", self.plot('soak', self.work('a.png'), self.work('no.json', {}), expect=1))

    def test_refuses_in_one_line(self):
        whole = self.work('whole.json', report(MIXED))
        self.assertIn('none.json', self.plot('evaluation', self.work('a.png'), self.work('none.json'), expect=1))
        self.assertIn('a.docx', self.plot('evaluation', self.work('a.docx'), whole, expect=1))
        self.assertIn("no 'trials'", self.plot('evaluation', self.work('a.png'), self.work('no.json', {}), expect=1))
        self.plot('evaluation', self.work('a.png'), whole, whole, expect=2)
        self.plot('painting', self.work('a.png'), whole, expect=2)

    def test_says_what_to_install(self):
        folder = self.work('without_matplotlib')
        os.makedirs(folder, exist_ok=True)
        with open(os.path.join(folder, 'matplotlib.py'), 'w') as file:
            file.write('raise ImportError("No module named matplotlib")\n')
        said = self.plot('evaluation', self.work('a.png'), self.work('whole.json', report(MIXED)), expect=1,
                         environment={'PYTHONPATH': folder})
        self.assertIn('python3-matplotlib', said)
        self.assertEqual(said.count('\n'), 1)


if __name__ == '__main__':
    PlotResults.work_folder = sys.argv.pop()
    os.makedirs(PlotResults.work_folder, exist_ok=True)
    unittest.main(verbosity=2)

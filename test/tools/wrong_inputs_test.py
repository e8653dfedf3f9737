#!/usr/bin/python3
"""What scripts/accuracy counts of wrong inputs.

usage: wrong_inputs_test.py
"""
import os
import sys
import unittest

SCRIPTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'scripts')
sys.dont_write_bytecode = True
sys.path.insert(0, SCRIPTS)

import wrong_inputs  # noqa: E402
from accuracy_rows import HEAD, PELVIS_BOTH, ROWS, WRONG, WRONG_ROWS, Row  # noqa: E402

ONE_VIEW = Row('one', HEAD, (6, 10), {}, wrong='half')
TWO_VIEWS = Row('two', PELVIS_BOTH, (6, 10), {}, wrong='half')


def trial(accepted, mtre, inplane, reason=''):
    return {'accepted': accepted, 'final_mtre': mtre, 'final_inplane': inplane, 'reason': reason, 'success': mtre < 1,
            'wrong': mtre > 5}


class WrongInputsTest(unittest.TestCase):
    def test_one_view_is_judged_by_what_it_sees(self):
        depth = trial(True, 20.0, 0.1)
        self.assertFalse(wrong_inputs.is_false(depth, ONE_VIEW))
        self.assertTrue(wrong_inputs.is_false(depth, TWO_VIEWS))
        self.assertTrue(wrong_inputs.is_false(trial(True, 20.0, 1.1), ONE_VIEW))
        self.assertFalse(wrong_inputs.is_false(trial(False, 20.0, 1.1), ONE_VIEW))
        # JSON's null is an infinite error.
        self.assertTrue(wrong_inputs.is_false(dict(depth, final_inplane=None), ONE_VIEW))

    def test_a_pose_that_turned_is_no_x_ray_that_is_turned(self):
        far = trial(False, 20.0, 20.0, 'the pose turned 20 degrees from the start, outside the range')
        named = trial(False, 20.0, 20.0, 'the X-ray looks turned by 180 degrees')
        self.assertFalse(wrong_inputs.names(far, ['turned_image']))
        self.assertTrue(wrong_inputs.names(named, ['turned_image']))
        self.assertFalse(wrong_inputs.names(named, ['mirrored_image']))

    def test_the_kinds_are_counted_apart(self):
        right = {'trials': [trial(True, 0.1, 0.1), trial(False, 0.1, 0.1, 'the focal length looks wrong'),
                            trial(True, 6.0, 6.0)]}
        wrong = {'trials': [trial(True, 20.0, 20.0), trial(True, 0.1, 0.1)]}
        lines = wrong_inputs.kinds([(ROWS[0], right), (ONE_VIEW, wrong)]).splitlines()
        self.assertIn('| 3 | 2 | 1 of 3 (33.3 %) | 1 of 2 (50.0 %) | 1 of 2 (50.0 %) |', lines[2])
        self.assertIn('| 0 | 0 |  |  |  |', lines[3])
        self.assertIn('| 2 | 2 | 1 of 2 (50.0 %) |  |  |', lines[4])

    def test_a_line_says_what_was_accepted_and_named(self):
        report = {'trials': [trial(True, 3.0, 2.0), trial(True, 1.0, 0.5), trial(False, 9.0, 9.0, 'it looks turned'),
                             trial(False, 9.0, 9.0, 'they do not look alike')],
                  'summary': {'views': ['']}, 'wrong': [{'text': 'turned_image:180', 'what': 'turned_image'}]}
        self.assertEqual(wrong_inputs.line(ONE_VIEW, report)[2:],
                         ['1', '4', '2', '1 (≤ 0, **missed**)', '3.00 / 2.00 mm', '1.25 mm', '1 of 2'])

    def test_depth_is_compared_with_its_sigma(self):
        focal = Row('focal', HEAD, (6, 10), {}, wrong='focal')
        both = Row('both', PELVIS_BOTH, (6, 10), {}, wrong='focal')
        trials = [dict(trial(True, 5.0, 0.6), depth_sigma_mm=2.0), dict(trial(False, 13.0, 0.5), depth_sigma_mm=10.0),
                  dict(trial(True, 90.0, 7.0), depth_sigma_mm=1.0)]
        lines = wrong_inputs.depth([(focal, {'trials': trials}), (both, {'trials': trials})]).splitlines()
        self.assertEqual(len(lines), 3, 'several views see depth')
        self.assertIn('| 2 of 3 | 9.0 mm | 6.0 mm | 2.48 |', lines[2])

    def test_rows_have_names_of_their_own_and_what_is_wrong_is_used(self):
        names = [row.name for row in ROWS + WRONG_ROWS]
        self.assertEqual(len(names), len(set(names)))
        self.assertEqual({row.wrong for row in WRONG_ROWS}, set(WRONG))


if __name__ == '__main__':
    unittest.main()

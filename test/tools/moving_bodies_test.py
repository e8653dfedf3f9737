#!/usr/bin/python3
"""What scripts/accuracy counts of bodies that move on their own.

usage: moving_bodies_test.py
"""
import os
import sys
import unittest

SCRIPTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'scripts')
sys.dont_write_bytecode = True
sys.path.insert(0, SCRIPTS)

import moving_bodies  # noqa: E402
from accuracy_rows import BODIES, BODY_ROWS, KNEE, SPINE, BodyRow, limits  # noqa: E402

TWO_VIEWS = BodyRow('two', SPINE, 'vertebrae', (3, 5), (2, 2), goals=limits(good=0.95, mtre=0.3))
ONE_VIEW = BodyRow('one', KNEE, 'implants', (5, 5), good={'final_rotation_deg': 1.5}, real=True)


def body(x_mm=0.0, accepted=True, mtre=0.1, inplane=0.1, rotation=0.1, reason=''):
    return {'accepted': accepted, 'final_mtre': mtre, 'final_inplane': inplane, 'final_rotation_deg': rotation,
            'reason': reason, 'centre_mm': [100, 0, 0],
            'T_camera_ct': [[1, 0, 0, x_mm], [0, 1, 0, 0], [0, 0, 1, 900], [0, 0, 0, 1]]}


def trials(*bodies):
    return [{'frame': 0, 'bodies': {'T12': one}} for one in bodies]


class MovingBodiesTest(unittest.TestCase):
    def test_agreement_is_with_the_middle_one_of_a_frame(self):
        found = trials(body(0.0), body(0.1), body(-0.1), body(5.0))
        self.assertEqual(moving_bodies.agreement(found, 'T12', 0.3), 0.75)
        found[3]['frame'] = 1
        self.assertEqual(moving_bodies.agreement(found, 'T12', 0.3), 1.0)

    def test_one_view_is_judged_by_what_it_sees(self):
        depth = body(mtre=20.0)
        self.assertTrue(moving_bodies.is_good(depth, ONE_VIEW))
        self.assertFalse(moving_bodies.is_good(depth, TWO_VIEWS))
        self.assertFalse(moving_bodies.is_good(body(rotation=2.0), ONE_VIEW))
        self.assertTrue(moving_bodies.is_good(body(rotation=2.0), TWO_VIEWS))
        # JSON's null is an infinite error.
        self.assertFalse(moving_bodies.is_good(body(mtre=None), TWO_VIEWS))

    def test_a_line_for_each_body_and_its_goals(self):
        found = trials(body(), body(mtre=0.5), body(accepted=False, reason='T12 moved 9.1 mm: far'), body(mtre=3.0))
        report = {'trials': found, 'summary': {'frame_ms': {'median': 100}}}
        line = moving_bodies.table([(TWO_VIEWS, report)]).splitlines()[2]
        for words in ('| T12 | 4 |', '75.0 % (≥ 95.0 %, **missed**)', '0.300 mm (≤ 0.300 mm)', '25.0 % (≤ 1.0 %, **missed**)',
                      '33.3 % (≤ 10.0 %, **missed**)', '| 100 ms |'):
            self.assertIn(words, line)
        self.assertIn('| 1 | the body moved … mm |', moving_bodies.refusals([(TWO_VIEWS, report)]))

    def test_every_row_has_its_configuration(self):
        self.assertEqual({row.bodies for row in BODY_ROWS}, set(BODIES))
        for text in BODIES.values():
            self.assertNotIn('{data}', text.format(data='/data'))
        self.assertEqual(len({row.name for row in BODY_ROWS}), len(BODY_ROWS))


if __name__ == '__main__':
    unittest.main()

#!/usr/bin/python3
"""inspect_ct and the options that say what a CT's numbers mean, as a user runs them."""
import argparse
import array
import os
import sys
import tarfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import tool_case  # noqa: E402


class InspectCtTest(tool_case.ToolTest):
    @classmethod
    def setUpClass(cls):
        cls.ct = cls.work('head.nii.gz')
        cls.tool('make_phantom', '--phantom', 'head', '--spacing', 4, '--output', cls.ct)

    def test_says_what_was_understood(self):
        out, err = self.tool('inspect_ct', self.ct, '--picture', self.work('planes.png'))
        self.assertEqual(err, '')
        self.assertRegex(out, r'(?m)^size: +\d+ x \d+ x \d+ voxels$')
        self.assertRegex(out, r'(?m)^spacing: +4\.0000 x 4\.0000 x 4\.0000 mm$')
        for axis, side in (('i', 'left'), ('j', 'back'), ('k', 'head')):
            self.assertRegex(out, r'(?m)^axis %s: +to the %s$' % (axis, side))
        self.assertRegex(out, r'air +\d+\.\d %, most of it -1000 HU')
        self.assertNotIn('warning', out)
        self.check_is_png('planes.png')

    def test_a_ct_that_would_be_refused_is_shown_and_fails(self):
        shifted = ('--hu-intercept', 1024)
        out, err = self.tool('inspect_ct', self.ct, *shifted, '--picture', self.work('shifted.png'), expect=1)
        self.assertRegex(out, r'(?m)^warning: .*ct/hu_intercept: -10')
        self.assertIn('ct/check_values', err)
        self.check_is_png('shifted.png')
        self.tool('inspect_ct', self.ct, *shifted, '--no-value-check')

    def test_wrong_arguments(self):
        self.tool('inspect_ct', expect=2)
        self.tool('inspect_ct', self.work('none.nii'), expect=2)
        self.tool('inspect_ct', self.ct, '--orientation', 'RAX', expect=2)
        self.tool('inspect_ct', self.ct, '--picture', self.work('no/such/folder/p.png'), expect=2)
        with open(self.work('words.nii'), 'w') as file:
            file.write('words')
        self.assertIn('words.nii', self.tool('inspect_ct', self.work('words.nii'), expect=1)[1])


@unittest.skipUnless('XRAY_REGISTRATION_DATA' in os.environ, 'XRAY_REGISTRATION_DATA names no folder')
class HardCtsTest(tool_case.ToolTest):
    """One head in files that readers stumble over, rendered from one place."""

    def mean_of_drr(self, ct, *options):
        folder = os.path.join(os.environ['XRAY_REGISTRATION_DATA'], 'hard_cts')
        output = self.work('drr.mha')
        said = self.tool('render', '--ct', os.path.join(folder, ct), '--camera', os.path.join(folder, 'camera.yaml'),
                         '--pose', os.path.join(folder, 'pose.yaml'), '--method', 'exact', '--output', output, *options)
        with open(output, 'rb') as file:
            pixels = array.array('f', file.read().split(b'LOCAL\n', 1)[1])
        return sum(pixels) / len(pixels), said[1]

    def test_the_same_head_in_the_same_place(self):
        for name, options in (('reference.nii.gz', ()), ('slope_zero_intercept.nii.gz', ()),
                              ('sform_right_qform_wrong.nii.gz', ()), ('micrometres.nii.gz', ()), ('las.nrrd', ()),
                              ('hu_plus_1024.nii.gz', ('--hu-intercept', '-1024'))):
            # Of 0.496, as stated with the files.
            self.assertAlmostEqual(self.mean_of_drr(name, *options)[0], 0.496, delta=0.001, msg=name)

    def test_padded_slices(self):
        with tarfile.open(os.path.join(os.environ['XRAY_REGISTRATION_DATA'], 'hard_cts',
                                       'dicom_padding_63536.tar.gz')) as packed:
            packed.extractall(self.work('padded'))
        # Thick slices of every fourth pixel, and the head rest is cut off; read as metal it is 19.
        self.assertAlmostEqual(self.mean_of_drr(self.work('padded'))[0], 0.48, delta=0.03)

    def test_what_the_file_does_not_say_is_said(self):
        self.assertIn('ct/orientation', self.mean_of_drr('no_orientation.nii.gz')[1])


if __name__ == '__main__':
    PARSER = argparse.ArgumentParser(description=__doc__)
    tool_case.add_folders(PARSER)
    ARGUMENTS = PARSER.parse_args()
    sys.exit(max(tool_case.run(case, ARGUMENTS) for case in (InspectCtTest, HardCtsTest)))

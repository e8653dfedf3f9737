#!/usr/bin/python3
"""Runs the tool `dicom_to_bag` as a user does, on X-rays that simulate_session stores as a C-arm would and on small
files that lack something; checks what it writes and what it asks for.

usage: dicom_to_bag_test.py --tools FOLDER --work FOLDER
"""
import argparse
import math
import os
import shutil
import sys

import rosbag
import small_dicom
import tool_case

GEOMETRY = {(0x0018, 0x1110): ('DS', '1000'), (0x0018, 0x1111): ('DS', '700'), (0x0018, 0x1164): ('DS', '0.5\\0.4'),
            (0x0018, 0x1510): ('DS', '30'), (0x0018, 0x1511): ('DS', '-10')}
PATIENT = ('SIMULATED', 'PHANTOM', 'DOE', 'JANE', '4711', '1962', '20211124', '19000101')


def messages(path):
    found = {}
    with rosbag.Bag(path) as bag:
        for topic, message, _ in bag.read_messages():
            found.setdefault(topic, []).append(message)
    return found


class DicomToBagTest(tool_case.ToolTest):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(cls.work_folder)
        os.makedirs(cls.work_folder)
        cls.tool('make_phantom', '--phantom', 'head', '--spacing', 2.5, '--output', cls.work('head.nii.gz'))
        cls.tool('simulate_session', '--ct', cls.work('head.nii.gz'), '--views', 'ap:0,oblique:-50', '--frames', 3,
                 '--size', 128, '--amplitude-deg', 3, '--amplitude-mm', 5, '--collimator-px', 60, '--output',
                 cls.work('simulated.bag'), '--dicom', cls.work('carm'))

    def convert(self, name, *words, expect=0):
        return self.tool('dicom_to_bag', '--output', self.work(name + '.bag'), *words, expect=expect)

    def small(self, name, attributes, value=None, **words):
        """A file of 6 × 8 pixels."""
        path = self.work(name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        rows = [[100 * row + 10 * column if value is None else value for column in range(8)] for row in range(6)]
        small_dicom.write(path, rows, attributes, **words)
        return path

    def test_a_c_arms_files_become_the_session_that_they_are(self):
        self.convert('converted', '--input', self.work('carm'), '--views', 'ap,oblique', '--ct', self.work('head.nii.gz'))
        made, true = messages(self.work('converted.bag')), messages(self.work('simulated.bag'))
        for view in ('ap', 'oblique'):
            self.assertEqual(len(made['/%s/image_raw' % view]), 3)
            for one, other in zip(made['/%s/image_raw' % view], true['/%s/image_raw' % view]):
                self.assertEqual(one, other)
            for one, other in zip(made['/%s/camera_info' % view], true['/%s/camera_info' % view]):
                self.assertEqual(one.header, other.header)
                for a, b in zip(one.K, other.K):
                    self.assertAlmostEqual(a, b, 9)
        one, other = (bag['/tf_static'][0].transforms[0] for bag in (made, true))
        self.assertEqual(one.child_frame_id, other.child_frame_id)
        for a, b in ((one.transform.translation, other.transform.translation),
                     (one.transform.rotation, other.transform.rotation)):
            for axis in a.__slots__:
                self.assertAlmostEqual(getattr(a, axis), getattr(b, axis), 6)
        # The patient is up to 5 mm and 3° from where the positioner has him.
        pose, truth = made['/initialpose'][0], true['/ap/ground_truth'][0]
        self.assertEqual(pose.header.frame_id, 'ap_xray_optical')
        for axis in 'xyzw':
            self.assertAlmostEqual(abs(getattr(pose.pose.pose.orientation, axis)),
                                   abs(getattr(truth.pose.orientation, axis)), delta=0.05)
        self.assertEqual(len(made['/oblique/positioner_pose']), 3)

    def test_the_session_registers_with_its_parameters(self):
        self.convert('start', '--input', self.work('carm'), '--views', 'ap,oblique', '--ct', self.work('head.nii.gz'))
        self.assertTrue(os.path.isfile(self.work('start_ap_mask.png')))
        for start in (('--config', self.work('start.yaml')), ('--initial-pose-topic', '/initialpose')):
            output, _ = self.tool('register_bag', '--ct', self.work('head.nii.gz'), '--bag', self.work('start.bag'),
                                  '--output', self.work('registered.bag'), *start)
            self.assertIn('3 of 3 frames accepted', output)
            output, _ = self.tool('compare_poses', '--ct', self.work('head.nii.gz'), '--bag', self.work('registered.bag'),
                                  '--reference', self.work('simulated.bag'), '--reference-topic', '/ap/ground_truth',
                                  '--json', self.work('errors.json'))
            # A phantom in voxels of 2.5 mm.
            self.assertLess(self.report('errors.json')['summary']['mtre']['median'], 0.5, output)

    def test_no_patient_gets_out(self):
        # A file's name may be the patient's too.
        shutil.copy(self.work('carm/ap.dcm'), self.work('SIMULATED-PHANTOM.dcm'))
        self.small('people/DOE_JANE.dcm', GEOMETRY)
        for name, source in (('one', 'SIMULATED-PHANTOM.dcm'), ('two', 'people')):
            output, error = self.convert(name, '--input', self.work(source), '--json', self.work(name + '.json'))
            written = output + error
            for file in os.listdir(self.work_folder):
                if file.startswith(name + '.') or file.startswith(name + '_'):
                    written += file
                if file in (name + '.json', name + '.yaml'):
                    with open(self.work(file)) as text:
                        written += text.read()
            for topic, found in messages(self.work(name + '.bag')).items():
                written += topic + ''.join(str(message.header) for message in found if hasattr(message, 'header'))
                self.assertLess(max(message.header.stamp.to_sec() for message in found), 2000)
            for word in PATIENT:
                self.assertNotIn(word, written)

    def test_what_is_missing_is_named_and_can_be_given(self):
        bare = self.small('bare.dcm', {})
        _, error = self.convert('bare', '--input', bare, expect=1)
        self.assertEqual(error.count('\n'), 1)
        for option in ('--source-detector-mm', '--pixel-mm', '--source-patient-mm', '--primary-deg', '--secondary-deg'):
            self.assertIn(option, error)
        self.assertFalse(os.path.exists(self.work('bare.bag')))
        # Enough for a camera, not for a pose.
        output, error = self.convert('bare', '--input', bare, '--source-detector-mm', 900, '--pixel-mm', '0.3,0.2')
        self.assertIn('first pose: none', output)
        self.assertIn('--primary-deg', error)
        self.assertIn('--mirrored', error)
        bag = messages(self.work('bare.bag'))
        self.assertEqual(bag['/xray/camera_info'][0].K[:6], (4500.0, 0.0, 3.5, 0.0, 3000.0, 2.5))
        self.assertNotIn('/initialpose', bag)
        output, _ = self.convert('bare', '--input', bare, '--source-detector-mm', 900, '--pixel-mm', 0.3,
                                 '--source-patient-mm', 600, '--primary-deg', 0, '--secondary-deg', 0,
                                 '--isocentre-ct-mm', '0,0,100', '--principal-point-px', '3,2')
        bag = messages(self.work('bare.bag'))
        # Seen from the detector: columns are written in reverse.
        self.assertEqual(bag['/xray/camera_info'][0].K[2], 7 - 3)
        self.assertEqual(bag['/xray/image_raw'][0].data[:4], b'\x46\0\x3c\0')
        pose = bag['/initialpose'][0].pose.pose
        self.assertAlmostEqual(pose.position.z, 0.6)
        self.assertAlmostEqual(pose.position.y, 0.1)  # The head is up, the CT's origin 100 mm below the isocentre.

    def test_inspection_is_a_table_with_sources(self):
        path = self.small('inspected.dcm', GEOMETRY)
        output, error = self.tool('dicom_to_bag', '--inspect', path, '--json', self.work('inspected.json'))
        self.assertEqual(error, '')
        for words in ('1000 mm', '(0018,1110)', '700 mm', '0.5 x 0.4 mm', '30 deg LAO', '-10 deg CAU', 'nothing is missing'):
            self.assertIn(words, output)
        view = self.report('inspected.json')['views']['xray']
        self.assertEqual((view['source_detector_mm'], view['pixel_mm'], view['primary_deg']), (1000, [0.5, 0.4], 30))
        self.assertEqual((view['missing'], view['kind'], view['mirrored']), ([], 'transmission', True))
        output, _ = self.tool('dicom_to_bag', '--inspect', self.small('bare.dcm', {}))
        self.assertIn('missing: ', output)
        self.assertIn('give --source-detector-mm', output)

    def test_kinds_are_said_and_written(self):
        inverted = self.small('inverted.dcm', GEOMETRY, photometric='MONOCHROME1')
        output, _ = self.convert('kind', '--input', inverted)
        self.assertIn('image/kind transmission', output)
        self.assertIn('written reversed', output)
        # 4095 less the stored value, columns in reverse.
        self.assertEqual(messages(self.work('kind.bag'))['/xray/image_raw'][0].data[-2:], (4095 - 500).to_bytes(2, 'little'))
        logarithm = self.small('logarithm.dcm', GEOMETRY, relationship='LOG')
        output, _ = self.convert('kind', '--input', logarithm)
        self.assertIn('image/kind attenuation', output)
        with open(self.work('kind.yaml')) as file:
            self.assertIn('kind: attenuation', file.read())
        output, _ = self.convert('kind', '--input', logarithm, '--kind', 'inverted')
        self.assertIn('image/kind inverted', output)
        self.assertEqual(messages(self.work('kind.bag'))['/xray/image_raw'][0].data[-2:], (500).to_bytes(2, 'little'))
        _, error = self.convert('kind', '--input', inverted, logarithm, expect=1)
        self.assertIn('one by one', error)

    def test_single_pictures_of_a_series_are_one_view_in_their_order(self):
        for number, name in ((2, 'series/a.dcm'), (1, 'series/b.dcm'), (3, 'series/c.dcm')):
            self.small(name, {**GEOMETRY, (0x0020, 0x000E): ('UI', '1.2.3.9'), (0x0020, 0x0013): ('IS', number),
                              (0x0008, 0x0032): ('TM', '1200%02d.500' % (10 * number))}, value=number)
        with open(self.work('series/readme.txt'), 'w') as file:
            file.write('no X-ray')
        self.convert('series', '--input', self.work('series'), '--views', 'run')
        images = messages(self.work('series.bag'))['/run/image_raw']
        self.assertEqual([image.data[0] for image in images], [1, 2, 3])
        self.assertEqual([image.header.stamp.to_sec() for image in images], [1000, 1010, 1020])

    def enhanced(self, name, left_out=()):
        """An Enhanced XA run of three frames whose geometry is in functional groups: the pixels' size is shared, the rest
        differs from frame to frame. left_out: groups that the last frame lacks."""
        frames = []
        for number, (primary, secondary, detector, time) in enumerate(
                ((0, 0, 1000, '120000.000'), (-20, 5, 1040, '120000.125'), (40, -10, 1100, '120000.500'))):
            # Macro by macro: frame content, geometry, positioner.
            frames.append({
                (0x0020, 0x9111): ('SQ', [{(0x0018, 0x9074): ('DT', '20211124' + time)}]),
                (0x0018, 0x9476): ('SQ', [{(0x0018, 0x1110): ('DS', detector), (0x0018, 0x9402): ('FL', [700 + 10 * number])}]),
                (0x0018, 0x9405): ('SQ', [{(0x0018, 0x1510): ('DS', primary), (0x0018, 0x1511): ('DS', secondary)}]),
            })
        for group in left_out:
            del frames[-1][group]
        shared = {(0x0028, 0x9443): ('SQ', [{(0x0018, 0x1164): ('DS', '0.5\\0.4')}])}
        rows = [[1000 * frame + 100 * row + column for column in range(8)] for frame in range(3) for row in range(6)]
        path = self.work(name)
        small_dicom.write(path, rows, {(0x5200, 0x9229): ('SQ', [shared]), (0x5200, 0x9230): ('SQ', frames)}, frames=3,
                          kind=small_dicom.ENHANCED_XA)
        return path

    def test_an_enhanced_file_has_each_frames_geometry(self):
        self.convert('enhanced', '--input', self.enhanced('enhanced.dcm'), '--isocentre-ct-mm', '0,0,0')
        bag = messages(self.work('enhanced.bag'))
        infos, images, poses = (bag['/xray/' + topic] for topic in ('camera_info', 'image_raw', 'positioner_pose'))
        self.assertEqual([round(image.header.stamp.to_sec(), 3) for image in images], [1000, 1000.125, 1000.5])
        for number, (info, image, pose) in enumerate(zip(infos, images, poses)):
            detector = (1000, 1040, 1100)[number]
            self.assertAlmostEqual(info.K[0], detector / 0.4, 3)
            self.assertAlmostEqual(info.K[4], detector / 0.5, 3)
            # The first row, its columns in reverse.
            values = [image.data[2 * i] + 256 * image.data[2 * i + 1] for i in range(8)]
            self.assertEqual(values, [1000 * number + column for column in range(7, -1, -1)])
            # The isocentre lies on the beam, and the beam goes along (sin p cos s, -cos p cos s, sin s) in the patient.
            self.assertAlmostEqual(pose.pose.position.z, 0.7 + 0.01 * number, 5)
            primary, secondary = (math.radians(angle) for angle in ((0, 0), (-20, 5), (40, -10))[number])
            q = pose.pose.orientation
            beam = (2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x), 1 - 2 * (q.x * q.x + q.y * q.y))
            for found, expected in zip(beam, (math.sin(primary) * math.cos(secondary),
                                              -math.cos(primary) * math.cos(secondary), math.sin(secondary))):
                self.assertAlmostEqual(found, expected, 5)

    def test_an_enhanced_file_that_lacks_one_frames_geometry_is_refused(self):
        path = self.enhanced('lacking.dcm', left_out=[(0x0018, 0x9476)])
        _, error = self.convert('lacking', '--input', path, expect=1)
        self.assertIn('--source-detector-mm (picture 3)', error)
        self.assertFalse(os.path.exists(self.work('lacking.bag')))
        output, _ = self.tool('dicom_to_bag', '--inspect', path)
        self.assertIn('missing in picture 3: distance from source to detector', output)
        self.convert('lacking', '--input', path, '--source-detector-mm', 1000, '--source-patient-mm', 700)
        self.assertEqual(len(messages(self.work('lacking.bag'))['/xray/image_raw']), 3)

    def test_a_study_of_many_runs_is_no_session(self):
        for number in range(3):
            self.small('study/%d.dcm' % number, {**GEOMETRY, (0x0018, 0x1510): ('DS', 30 * number)})
        _, error = self.convert('study', '--input', self.work('study'), expect=2)
        self.assertIn('3 runs', error)
        output, _ = self.tool('dicom_to_bag', '--inspect', self.work('study'))
        self.assertIn('60 deg LAO', output)
        self.convert('study', '--input', self.work('study'), '--views', 'a,b,c')
        self.assertEqual(len(messages(self.work('study.bag'))['/tf_static'][0].transforms), 2)

    def test_wrong_arguments(self):
        path = self.small('fine.dcm', GEOMETRY)
        for words, said in ((['--input', path], '--output is required'), (['--inspect'], 'input'),
                            (['--input', path, '--output', self.work('x.txt')], 'must end in .bag'),
                            (['--inspect', path, '--pixel-mm', '0'], 'above zero'),
                            (['--inspect', path, '--pixel-mm', 'small'], 'not a number'),
                            (['--inspect', path, '--views', 'a,b'], '1 runs'), (['--inspect', path, '--views', 'a b'], 'name'),
                            (['--inspect', path, '--isocentre-ct-mm', '1,2'], 'three numbers')):
            if said == 'three numbers':
                words = ['--input', path, '--output', self.work('x.bag'), '--isocentre-ct-mm', '1,2']
            _, error = self.tool('dicom_to_bag', *words, expect=2)
            self.assertIn(said, error)
        with open(self.work('words.dcm'), 'w') as file:
            file.write('words')
        _, error = self.tool('dicom_to_bag', '--inspect', self.work('words.dcm'), expect=1)
        self.assertIn('words.dcm', error)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tool_case.add_folders(parser)
    return tool_case.run(DicomToBagTest, parser.parse_args())


if __name__ == '__main__':
    sys.exit(main())

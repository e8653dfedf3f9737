#!/usr/bin/python3
"""Hands the tools files that somebody made to do harm: they are refused in one line, nothing is written beside what was
named, and no more memory is taken than a file of honest contents needs.

usage: hostile_inputs_test.py --tools FOLDER --work FOLDER
"""
import argparse
import gzip
import os
import re
import shutil
import struct
import subprocess
import sys
import time
import zlib

import genpy
import rosbag
import small_dicom
import tool_case
from sensor_msgs.msg import CameraInfo, Image

# A tool's own needs, the address sanitizer's included; what the bombs below unpack to is ten times that.
MOST_MIB = 700
# Names that would write elsewhere, order a terminal, or forge a line of a log.
ESCAPE = '\x1b[2J'
FORGED = 'x' + ESCAPE + '\n[ INFO] all is well'
CONTROL = re.compile('[\x00-\x09\x0b-\x1f\x7f]')


def listing(folder):
    return sorted(os.path.join(place, name) for place, folders, files in os.walk(folder) for name in folders + files)


def view_messages(stamp_s, frame_id):
    image = Image(width=16, height=16, encoding='mono8', step=16, data=bytes(range(256)))
    image.header.stamp = genpy.Time.from_sec(stamp_s)
    image.header.frame_id = frame_id
    info = CameraInfo(width=16, height=16, K=[500, 0, 7.5, 0, 500, 7.5, 0, 0, 1])
    info.header = image.header
    return image, info


def nifti_header(size):
    header = bytearray(352)
    struct.pack_into('<i', header, 0, 348)
    struct.pack_into('<8h', header, 40, 3, *size, 1, 1, 1, 1)
    struct.pack_into('<hh', header, 70, 4, 16)
    struct.pack_into('<8f', header, 76, 1, 1, 1, 1, 0, 0, 0, 0)
    struct.pack_into('<3f', header, 108, 352, 1, 0)
    struct.pack_into('<2h', header, 252, 0, 1)
    struct.pack_into('<12f', header, 280, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)
    header[344:348] = b'n+1\0'
    return bytes(header)


class HostileInputs(tool_case.ToolTest):
    def setUp(self):
        shutil.rmtree(self.work_folder, ignore_errors=True)
        os.makedirs(self.work('out'))
        with open(self.work('ct.nii'), 'wb') as file:
            file.write(b'never read')

    def run_tool(self, name, *words):
        """Returns the exit code, standard error, and the most memory in MiB; the tool may not be ended by a signal."""
        with open(self.work('stderr'), 'w') as said:
            process = subprocess.Popen([os.path.join(self.folder, name)] + [str(word) for word in words], stderr=said,
                                       stdout=subprocess.DEVNULL)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = 0  # It was waited for.
        with open(self.work('stderr'), newline='') as said:
            text = said.read()
        os.remove(self.work('stderr'))
        self.assertTrue(os.WIFEXITED(status), '%s: ended by signal %d\n%s' % (name, status & 127, text))
        return os.WEXITSTATUS(status), text, usage.ru_maxrss / 1024

    def check_refused(self, *line):
        """Refused with one line of plain words, cheaply; nothing is written. Returns the words."""
        before = listing(self.work_folder)
        code, text, mib = self.run_tool(*line)
        self.assertIn(code, (1, 2), text)
        self.assertIsNone(CONTROL.search(text), repr(text))
        self.assertEqual(len([words for words in text.splitlines() if 'warning: ' not in words]), 1, repr(text))
        self.assertLess(mib, MOST_MIB, line)
        self.assertEqual(listing(self.work_folder), before)
        return text

    def write_bag(self, name, view, frame_id='xray'):
        with rosbag.Bag(self.work(name), 'w') as bag:
            image, info = view_messages(1.0, frame_id)
            bag.write(view + '/image_raw', image, image.header.stamp)
            bag.write(view + '/camera_info', info, info.header.stamp)

    def register(self, bag, *more):
        return ('register_bag', '--ct', self.work('ct.nii'), '--bag', self.work(bag), '--output',
                self.work('out/result.bag'), '--overlay', self.work('out/overlay')) + more

    def test_views_with_names_of_other_folders(self):
        for i, view in enumerate(('/../../evil', '/ap/../../evil', '/..', '/ap' + ESCAPE, '/a b')):
            self.write_bag('%d.bag' % i, view)
            self.assertIn('no X-rays', self.check_refused(*self.register('%d.bag' % i)))

    def test_damaged_bags(self):
        self.write_bag('whole.bag', '/ap')
        with open(self.work('whole.bag'), 'rb') as file:
            whole = file.read()
        index = whole.index(b'index_pos=') + len(b'index_pos=')
        damaged = {'cut': whole[:len(whole) // 2], 'empty': b'', 'header': whole[:20]}
        for name, position in ('beyond', len(whole) + 1000), ('within', 5000), ('far', 2 ** 62), ('chunk', 4117):
            damaged[name] = whole[:index] + struct.pack('<Q', position) + whole[index + 8:]
        # What a record says of its length: 4 GiB.
        damaged['length'] = whole[:4117] + b'\xff\xff\xff\xff' + whole[4121:]
        for name, content in damaged.items():
            with open(self.work(name + '.bag'), 'wb') as file:
                file.write(content)
            self.assertIn(name + '.bag', self.check_refused(*self.register(name + '.bag')))

    def test_names_of_files(self):
        path = self.work(FORGED + '.nii.gz')
        self.assertIn('\\x1b[2J\\n[ INFO]', self.check_refused('inspect_ct', path))
        with open(path, 'wb') as file:
            file.write(b'no volume')
        self.assertIn('\\x1b[2J\\n[ INFO]', self.check_refused('inspect_ct', path))

    def test_compressed_volumes(self):
        # More than there may be voxels; more than can be unpacked from the file.
        for size in (2000, 2000, 2000), (1200, 1200, 1200):
            with gzip.open(self.work('bomb.nii.gz'), 'wb') as file:
                file.write(nifti_header(size) + bytes(1000))
            begin = time.monotonic()
            self.check_refused('inspect_ct', self.work('bomb.nii.gz'))
            self.assertLess(time.monotonic() - begin, 20.0)
        # A small volume with 4 GiB of zeros behind it, which nobody asked for.
        zeros = gzip.compress(bytes(2 ** 26), 1)
        with open(self.work('behind.nii.gz'), 'wb') as file:
            voxels = struct.pack('<4096h', *(-1000 if i < 2048 else 40 + i % 60 for i in range(4096)))
            file.write(gzip.compress(nifti_header((16, 16, 16)) + voxels) + 64 * zeros)
        code, text, mib = self.run_tool('inspect_ct', self.work('behind.nii.gz'))
        self.assertEqual(code, 0, text)
        self.assertLess(mib, MOST_MIB)

    def test_deflated_dicom(self):
        os.makedirs(self.work('series'))
        packer = zlib.compressobj(1, zlib.DEFLATED, -15)
        small_dicom.write(self.work('series/a.dcm'), [[1, 2], [3, 4]], {})
        with open(self.work('series/a.dcm'), 'rb') as file:
            content = file.read()
        syntax = b'UI\x14\x001.2.840.10008.1.2.1\x00'
        head = content[:content.index(syntax)] + b'UI\x16\x001.2.840.10008.1.2.1.99'
        rest = content[content.index(syntax) + len(syntax):]
        meta, data = rest[:rest.index(b'\x08\x00\x16\x00')], rest[rest.index(b'\x08\x00\x16\x00'):]
        # An attribute of 1 GiB before the pixels.
        private = struct.pack('<HH', 0x29, 0x10) + b'OB\0\0' + struct.pack('<I', 2 ** 30)
        pixels = data.index(b'\xe0\x7f\x10\x00')
        with open(self.work('series/a.dcm'), 'wb') as file:
            file.write(head + meta + packer.compress(data[:pixels] + private))
            for _ in range(2 ** 6):
                file.write(packer.compress(bytes(2 ** 24)))
            file.write(packer.compress(data[pixels:]) + packer.flush())
        self.assertIn('deflated', self.check_refused('dicom_to_bag', '--input', self.work('series/a.dcm'), '--output',
                                                     self.work('out/a.bag')))
        self.check_refused('inspect_ct', self.work('series'))

    def test_strings_in_dicom(self):
        text = ('LO', '../../evil' + ESCAPE)
        # Deep enough that two folders up is still within: other tests write beside this one's folder.
        os.makedirs(self.work('strings/nested/out'))
        xray, bag = self.work('strings/nested/xray.dcm'), self.work('strings/nested/out/a.bag')
        small_dicom.write(xray, [[100 + x + y for x in range(16)] for y in range(16)],
                          {(0x0008, 0x0060): ('CS', 'XA' + ESCAPE), (0x0020, 0x000e): ('UI', '../../evil'),
                           (0x0008, 0x103e): text, (0x0018, 0x1110): ('DS', '1200'), (0x0018, 0x1111): ('DS', '800'),
                           (0x0018, 0x1164): ('DS', '0.2\\0.2'), (0x0018, 0x1510): ('DS', '0'),
                           (0x0018, 0x1511): ('DS', '0'), (0x0020, 0x0020): ('CS', 'L\\F' + ESCAPE)})
        before = listing(self.work('strings'))
        said, warned = self.tool('dicom_to_bag', '--inspect', xray)
        self.assertIsNone(CONTROL.search(said + warned), repr(said + warned))
        said, warned = self.tool('dicom_to_bag', '--input', xray, '--output', bag)
        self.assertIsNone(CONTROL.search(said + warned), repr(said + warned))
        new = set(listing(self.work('strings'))) - set(before)
        self.assertTrue(new)
        self.assertEqual([path for path in new if os.path.dirname(path) != os.path.dirname(bag)], [])

    def test_parameters_that_grow(self):
        lines = ['a0: &a0 [%s]' % ', '.join(10 * ['x'])]
        for i in range(1, 12):
            lines.append('a%d: &a%d [%s]' % (i, i, ', '.join(10 * ['*a%d' % (i - 1)])))
        self.write_bag('session.bag', '/ap')
        for name, text in (('aliases', '\n'.join(lines) + '\naccept: *a11\n'), ('itself', 'a: &a [*a]\naccept: *a\n'),
                           ('deep', 'accept: ' + 200000 * '['), ('long', 'device: ' + 2 ** 21 * 'x'),
                           ('forged', 'method: "%s"\n' % '\\e[2J\\n[ INFO] fine')):
            with open(self.work(name + '.yaml'), 'w') as file:
                file.write(text)
            self.check_refused(*self.register('session.bag', '--config', self.work(name + '.yaml')))
            self.check_refused(*self.register('session.bag', '--initial-pose', self.work(name + '.yaml')))


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tool_case.add_folders(parser)
    sys.exit(tool_case.run(HostileInputs, parser.parse_args()))

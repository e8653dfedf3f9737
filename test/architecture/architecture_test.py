#!/usr/bin/python3
"""The checks of the architecture themselves: a sound tree passes, and each fault that they are for is found.

usage: architecture_test.py
"""
import os
import subprocess
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOMS = ['sh', os.path.join(HERE, 'check_rooms.sh')]
PRIVATE = ['/usr/bin/env', 'python3', os.path.join(HERE, 'check_private_headers.py')]

# Two rooms, drr below registration, and whatever else may include them.
SOUND = {
    'include/xray_registration/drr/engine.h': '#pragma once\n',
    'include/xray_registration/registration/registrar.h': '#include "xray_registration/drr/engine.h"\n',
    'src/drr/filter.h': '#pragma once\n',
    'src/drr/engine.cpp': '#include "xray_registration/drr/engine.h"\n#include "drr/filter.h"\n#include <vector>\n',
    'src/registration/registrar.cpp': '#include "xray_registration/registration/registrar.h"\n',
    'src/tools/common/files.h': '#pragma once\n',
    'src/tools/render.cpp': '#include "tools/common/files.h"\n#include "xray_registration/drr/engine.h"\n',
    'src/volume/itk_image_file.cpp': '#include <itkImage.h>\n',
    'src/ros/node.cpp': '#include <ros/ros.h>\n',
    'test/drr/filter_test.cpp': '#include "drr/filter.h"\n',
    'benchmark/kernels.cpp': '#include "tools/common/files.h"\n',
}


class ArchitectureTest(unittest.TestCase):
    def run_check(self, check, changed):
        """(exit code, output) of a check on the sound tree with some files of another content."""
        with tempfile.TemporaryDirectory() as root:
            for path, text in dict(SOUND, **changed).items():
                os.makedirs(os.path.join(root, os.path.dirname(path)), exist_ok=True)
                with open(os.path.join(root, path), 'w') as file:
                    file.write(text)
            done = subprocess.run(check + [root], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  universal_newlines=True)
            return done.returncode, done.stdout

    def expect_fault(self, check, path, text):
        code, output = self.run_check(check, {path: text})
        self.assertEqual(code, 1, output)
        self.assertIn(path, output)

    def test_a_sound_tree_passes(self):
        for check in ROOMS, PRIVATE:
            code, output = self.run_check(check, {})
            self.assertEqual(code, 0, output)

    def test_an_empty_tree_is_a_fault(self):
        with tempfile.TemporaryDirectory() as root:
            self.assertEqual(subprocess.run(PRIVATE + [root], stdout=subprocess.DEVNULL).returncode, 1)

    def test_a_room_includes_a_higher_one(self):
        for path in 'src/drr/engine.cpp', 'include/xray_registration/drr/engine.h':
            self.expect_fault(ROOMS, path, '#include "xray_registration/registration/registrar.h"\n')

    def test_the_core_includes_ros(self):
        self.expect_fault(ROOMS, 'src/drr/engine.cpp', '#include <ros/ros.h>\n')

    def test_itk_stands_elsewhere(self):
        self.expect_fault(ROOMS, 'src/volume/volume_io.cpp', '#include <itkImage.h>\n')

    def test_opencl_leaves_its_room(self):
        for line in '#include "xray_registration/drr/opencl/launch.h"', 'cl::Buffer pixels;', 'void wait(cl_event event);':
            for path in ('src/registration/registrar.cpp', 'include/xray_registration/registration/registrar.h',
                         'src/ros/node.cpp', 'include/xray_registration/drr/engine.h',
                         'include/xray_registration/drr/paper/paper_engine.h'):
                self.expect_fault(ROOMS, path, line + '\n')

    def test_a_private_header_of_another_room(self):
        for path in ('src/registration/registrar.cpp', 'src/tools/render.cpp', 'benchmark/kernels.cpp',
                     'test/registration/registrar_test.cpp', 'include/xray_registration/registration/registrar.h'):
            self.expect_fault(PRIVATE, path, '#pragma once\n#include "drr/filter.h"\n')

    def test_a_private_header_by_another_path(self):
        for spelling in '"../drr/filter.h"', '"../../src/drr/filter.h"', '"src/drr/filter.h"', '<drr/filter.h>':
            self.expect_fault(PRIVATE, 'src/registration/registrar.cpp', '#  include %s\n' % spelling)

    def test_a_public_header_of_a_room_includes_a_private_one_by_path(self):
        self.expect_fault(PRIVATE, 'include/xray_registration/registration/registrar.h',
                          '#include "../../../src/drr/filter.h"\n')

    def test_a_higher_room_by_a_path_that_the_rooms_check_does_not_read(self):
        self.expect_fault(PRIVATE, 'src/drr/engine.cpp',
                          '#include "../../include/xray_registration/registration/registrar.h"\n')


if __name__ == '__main__':
    unittest.main(verbosity=2)

#!/usr/bin/python3
"""Runs the tool `landmarks` as a user does: on points of a simulated session, whose pixels its true poses give.

usage: landmarks_test.py --tools FOLDER --work FOLDER
"""
import argparse
import json
import sys

import rosbag
import tool_case

# On a sphere of 60 mm about the CT's centre.
AROUND = {'front': (0, -60, 0), 'left': (60, 0, 0), 'right': (-55, 10, 20), 'top': (5, 10, 58), 'low': (20, -30, -48),
          'back': (-25, 54, 10), 'side': (40, 40, -20)}


def times(rows, point):
    return [sum(row[i] * value for i, value in enumerate(list(point) + [1.0])) for row in rows[:3]]


class LandmarksTest(tool_case.ToolTest):
    @classmethod
    def setUpClass(cls):
        cls.make_session(frames=1)
        session = cls.report('session.json')
        centre = session['centre_lps_mm']
        cls.points = {name: [a + b for a, b in zip(centre, offset)] for name, offset in AROUND.items()}
        cls.truth = {view: found['T_camera_ct'] for view, found in session['frames'][0]['views'].items()}
        with rosbag.Bag(cls.work('session.bag')) as bag:
            cls.k = next(bag.read_messages('/ap/camera_info'))[1].K
        with open(cls.work('camera.yaml'), 'w') as file:
            file.write('{width: 128, height: 128, fx: %r, fy: %r, cx: %r, cy: %r}' % (cls.k[0], cls.k[4], cls.k[2], cls.k[5]))

    def pixel(self, name, view='ap'):
        x, y, z = times(self.truth[view], self.points[name])
        return self.k[0] * x / z + self.k[2], self.k[4] * y / z + self.k[5]

    def table(self, file, names=AROUND, views=('ap',)):
        with open(self.work(file), 'w') as out:
            out.write('# clicked\nname, x_mm, y_mm, z_mm, u_px, v_px, view\n')
            for name in names:
                for view in views:
                    cells = list(self.points[name]) + list(self.pixel(name, view))
                    out.write('"%s", %s, %s\n' % (name, ', '.join(repr(cell) for cell in cells), view))
        return self.work(file)

    def markups(self, file, system, sign, with_pixels=True):
        controls = [{'label': name, 'description': '%r, %r' % self.pixel(name) if with_pixels else '',
                     'position': [sign * point[0], sign * point[1], point[2]], 'positionStatus': 'defined'}
                    for name, point in self.points.items()]
        controls.append({'label': 'not placed', 'position': [0, 0, 0], 'positionStatus': 'undefined'})
        markup = {'type': 'Fiducial', 'coordinateUnits': 'mm', 'controlPoints': controls}
        if system:
            markup['coordinateSystem'] = system
        with open(self.work(file), 'w') as out:
            json.dump({'markups': [markup]}, out)
        return self.work(file)

    def solve(self, points, *words, expect=0, camera=('--camera', 'camera.yaml')):
        camera = (camera[0], self.work(camera[1]))
        return self.tool('landmarks', '--ct', self.work('head.nii.gz'), *camera, '--points', points, '--output',
                         self.work('pose.yaml'), '--json', self.work('pose.json'), *words, expect=expect)

    def check_pose(self, view='ap'):
        """Exact pixels give the exact pose."""
        made = self.report('pose.json')
        for point in self.points.values():
            for a, b in zip(times(made['T_camera_ct'], point), times(self.truth[view], point)):
                self.assertAlmostEqual(a, b, 3)
        self.assertTrue(all(point['used'] for point in made['points']))

    def test_a_table(self):
        output, _ = self.solve(self.table('points.csv'))
        self.assertIn('7 of 7 points agree', output)
        self.check_pose()
        # The pose is what other tools read.
        self.tool('register_bag', '--ct', self.work('head.nii.gz'), '--bag', self.work('session.bag'), '--views', 'ap',
                  '--initial-pose', self.work('pose.yaml'), '--output', self.work('registered.bag'))

    def test_markups_say_whose_axes_they_have(self):
        for system, sign in (('LPS', 1), ('RAS', -1)):
            self.solve(self.markups('points.mrk.json', system, sign))
            self.check_pose()
            with open(self.work('points.fcsv'), 'w') as out:
                out.write('# Markups fiducial file version = 4.11\n# CoordinateSystem = %s\n' % system)
                out.write('# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n')
                for name, point in self.points.items():
                    out.write('1,%r,%r,%r,0,0,0,1,1,1,0,%s,"%r, %r",\n' %
                              (sign * point[0], sign * point[1], point[2], name, *self.pixel(name)))
            self.solve(self.work('points.fcsv'))
            self.check_pose()
        _, error = self.solve(self.markups('points.mrk.json', '', 1), expect=1)
        self.assertIn('coordinate system', error)

    def test_axes_of_another_system_are_found_out(self):
        # The middle of the head lies 150 mm off the CT's origin, so RAS taken for LPS falls out of it.
        moved = {name: [point[0] + 150, point[1], point[2]] for name, point in self.points.items()}
        with open(self.work('moved.csv'), 'w') as out:
            out.write('name,x_mm,y_mm,z_mm,u_px,v_px\n')
            for name, point in moved.items():
                out.write('%s,%r,%r,%r,%r,%r\n' % (name, *point, *self.pixel(name)))
        _, error = self.solve(self.work('moved.csv'), expect=1)
        self.assertIn('outside of the CT', error)

    def test_a_column_that_is_named_twice(self):
        # The second one was looked for behind the end of the line.
        with open(self.work('twice.csv'), 'w') as out:
            out.write('name,name,x_mm,y_mm,z_mm,u_px,v_px\na,b,1,2,3,4,5\n')
        _, error = self.solve(self.work('twice.csv'), expect=1)
        self.assertIn('names the column name twice', error)

    def test_pixels_of_their_own_file(self):
        points = self.markups('bare.mrk.json', 'LPS', 1, with_pixels=False)
        _, error = self.solve(points, expect=1)
        self.assertIn('--pixels', error)
        with open(self.work('pixels.csv'), 'w') as out:
            out.write('name,u_px,v_px\n')
            for name in self.points:
                out.write('%s,%r,%r\n' % (name, *self.pixel(name)))
        self.solve(points, '--pixels', self.work('pixels.csv'))
        self.check_pose()
        with open(self.work('pixels.csv'), 'a') as out:
            out.write('nowhere,1,2\n')
        _, error = self.solve(points, '--pixels', self.work('pixels.csv'), expect=1)
        self.assertIn("'nowhere'", error)

    def test_several_views_of_a_bag(self):
        three = self.table('three.csv', ['front', 'left', 'top'], ['ap', 'oblique'])
        self.solve(three, camera=('--bag', 'session.bag'))
        self.check_pose()
        # The first view named is the frame of the pose.
        self.solve(three, '--views', 'oblique,ap', camera=('--bag', 'session.bag'))
        self.check_pose('oblique')
        _, error = self.solve(three, '--views', 'ap', camera=('--bag', 'session.bag'), expect=1)
        self.assertIn("view 'oblique'", error)

    def test_points_that_give_no_pose_are_refused_with_the_reason(self):
        _, error = self.solve(self.table('few.csv', ['front', 'left', 'top']), expect=1)
        self.assertIn('too few', error)
        with open(self.table('mirrored.csv')) as file:
            lines = file.read().splitlines()
        with open(self.work('mirrored.csv'), 'w') as out:
            for line in lines:
                cells = line.split(', ')
                if len(cells) == 7 and cells[4] != 'u_px':
                    cells[4] = repr(127 - float(cells[4]))
                out.write(', '.join(cells) + '\n')
        _, error = self.solve(self.work('mirrored.csv'), expect=1)
        self.assertIn('mirror image', error)
        self.assertEqual(error.count('\n'), 1)

    def test_wrong_files_and_arguments(self):
        with open(self.work('bad.csv'), 'w') as out:
            out.write('name,x_mm,y_mm,z_mm,u_px,v_px\na,1,2,3,four,5\n')
        _, error = self.solve(self.work('bad.csv'), expect=1)
        self.assertIn("line 2: 'four' in column u_px", error)
        with open(self.work('bad.csv'), 'w') as out:
            out.write('a,1,2,3,4,5\n')
        _, error = self.solve(self.work('bad.csv'), expect=1)
        self.assertIn('no column x_mm', error)
        _, error = self.tool('landmarks', '--ct', self.work('head.nii.gz'), '--points', self.work('bad.csv'), '--output',
                             self.work('pose.yaml'), expect=2)
        self.assertIn('--camera is required', error)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tool_case.add_folders(parser)
    return tool_case.run(LandmarksTest, parser.parse_args())


if __name__ == '__main__':
    sys.exit(main())

#!/usr/bin/python3
"""Writes the seeds of test/fuzz/corpus anew: small whole files of every kind that is parsed, for fuzzers to begin with.

usage: make_seeds.py [FOLDER]
"""
import gzip
import io
import os
import struct
import sys
import zlib

import genpy
import rosbag
from geometry_msgs.msg import PoseStamped, TransformStamped
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage

FOLDER = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), 'corpus')


def path(target, name):
    folder = os.path.join(FOLDER, target)
    os.makedirs(folder, exist_ok=True)
    return os.path.join(folder, 'seed_' + name)


def write(target, name, content):
    with open(path(target, name), 'wb') as file:
        file.write(content.encode() if isinstance(content, str) else content)


def texts():
    write('parameters', 'groups', '''ct: {path: ct.nii.gz, hu_slope: 1.5, padding: -2000, orientation: LPS, label: 3}
image: {kind: inverted, open_field: 0, masks: {ap: a.png}, undistortion_map: map.yaml}
views: [ap, carm/lateral]
frames: {ct: patient, fixed: world}
initial_pose: {position: [0, 0.1, 0.8], orientation: [0.7071, 0, 0, 0.7071], frame_id: ap_optical}
accept: {min_similarity: 0.3, max_jump_rad: 0.1}
solver: {similarity: correlation, search_poses: 100}
health: {image_age_warn: 1, image_age_error: 2}
method: fast
''')
    write('parameters', 'bodies', '''ct: {path: ct.nrrd, mask: labels.seg.nrrd}
bodies:
  - {name: T11, label: T11, frame: t11, max_rotation: 20, max_translation: 10}
  - {name: T12, labels: [12, 13], initial_pose: none}
  - {name: rod, mesh: rod.stl, attenuation: 0.3, initial_pose: {T_camera_ct_mm: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}}
''')
    write('parameters', 'alias', 'solver: &a {search: true}\ntracking: *a\n')
    matrix = 'rows: 3, cols: 3, data: [900, 0, 90, 0, 900, 40, 0, 0, 1]'
    write('camera_yaml', 'ros', '''image_width: 200
image_height: 100
camera_name: ap
camera_matrix: {%s}
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
''' % matrix)
    write('camera_yaml', 'short', '{width: 200, height: 100, fx: 900, cy: 40}')
    write('camera_yaml', 'distances', '{width: 200, height: 100, source_detector_mm: 1000, pixel_mm: 0.5}')
    write('pose_yaml', 'quaternion', '{position: [0.0, 0.1, 0.8], orientation: [0.7071, 0, 0, 0.7071]}')
    write('pose_yaml', 'matrix', 'initial_pose:\n  T_camera_ct_mm: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 800, 0, 0, 0, 1]\n')
    write('landmarks', 'table', '\0name,x_mm,y_mm,z_mm,u_px,v_px,view\nasis,1,2.5,-3,100,200,ap\nasis,1,2.5,-3,90,210,"lat"\n')
    write('landmarks', 'markups', '\1{"markups": [{"coordinateSystem": "LPS", "coordinateUnits": "mm", "controlPoints": '
          '[{"label": "a", "description": "10, 20, ap", "position": [1, 2, 3], "positionStatus": "defined"}]}]}')
    write('landmarks', 'fiducials', '\2# CoordinateSystem = RAS\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc\n'
          '1,1,2,3,0,0,0,1,1,1,0,a,"10, 20"\n')
    write('undistortion_map', 'map', '''%YAML:1.0
---
format: "xray_registration undistortion map 1"
image_width: 16
image_height: 12
degree: 1
centre: [ 8., 6. ]
scale: 8.
displacement_u: [ 0.1, 0.2, 0. ]
displacement_v: [ 0., 0., -0.1 ]
hull: [ 0., 0., 15., 0., 15., 11., 0., 11. ]
''')
    write('segment_names', 'segments', '''NRRD0004
type: short
dimension: 3
kinds: domain domain domain
Segment0_Name:=T11
Segment0_LabelValue:=1
Segment0_Layer:=0
Segment1_Name:=T12
Segment1_LabelValue:=2
Segment1_Layer:=0

''')


VOXELS = struct.pack('<64h', *[-1000 if i < 32 else 40 + i for i in range(64)])


def nifti(version):
    if version == 1:
        header = bytearray(348)
        struct.pack_into('<i', header, 0, 348)
        struct.pack_into('<8h', header, 40, 3, 4, 4, 4, 1, 1, 1, 1)
        struct.pack_into('<hh', header, 70, 4, 16)
        struct.pack_into('<8f', header, 76, 1, 1, 1, 2, 0, 0, 0, 0)
        struct.pack_into('<3f', header, 108, 352, 1, 0)
        header[123] = 2
        struct.pack_into('<2h', header, 252, 1, 1)
        struct.pack_into('<6f', header, 256, 0, 0, 0, -10, -20, -30)
        struct.pack_into('<12f', header, 280, 1, 0, 0, -10, 0, 1, 0, -20, 0, 0, 2, -30)
        header[344:348] = b'n+1\0'
    else:
        header = bytearray(540)
        struct.pack_into('<i', header, 0, 540)
        header[4:12] = b'n+2\0\r\n\x1a\n'
        struct.pack_into('<hh', header, 12, 4, 16)
        struct.pack_into('<8q', header, 16, 3, 4, 4, 4, 1, 1, 1, 1)
        struct.pack_into('<8d', header, 104, 1, 1, 1, 2, 0, 0, 0, 0)
        struct.pack_into('<q', header, 168, 544)
        struct.pack_into('<2d', header, 176, 1, 0)
        struct.pack_into('<2i', header, 344, 0, 1)
        struct.pack_into('<12d', header, 400, 1, 0, 0, -10, 0, 1, 0, -20, 0, 0, 2, -30)
        struct.pack_into('<i', header, 500, 2)
    return bytes(header) + b'\0\0\0\0' + VOXELS


def volumes():
    write('nifti', 'one', nifti(1))
    write('nifti', 'two', nifti(2))
    write('nifti', 'gzip', gzip.compress(nifti(1), mtime=0))
    nrrd = ('NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 4 4\n'
            'space directions: (1,0,0) (0,1,0) (0,0,2)\nkinds: domain domain domain\nendian: little\nencoding: %s\n'
            'space origin: (-10,-20,-30)\n\n')
    write('nrrd', 'raw', (nrrd % 'raw').encode() + VOXELS)
    write('nrrd', 'gzip', (nrrd % 'gzip').encode() + gzip.compress(VOXELS, mtime=0))
    write('nrrd', 'ascii', (nrrd % 'ascii').encode() + b' '.join(b'%d' % (i * 10 - 300) for i in range(64)))
    write('nrrd', 'spacings', 'NRRD0001\ntype: uchar\ndimension: 3\nsizes: 4 4 4\nspacings: 1 1 2\nencoding: raw\n\n'.encode() +
          bytes(range(64)))
    meta = ('ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = %s\n%s'
            'TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = -10 -20 -30\nElementSpacing = 1 1 2\nDimSize = 4 4 4\n'
            'ElementType = MET_SHORT\nElementDataFile = LOCAL\n')
    packed = zlib.compress(VOXELS)
    write('meta_image', 'raw', (meta % ('False', '')).encode() + VOXELS)
    write('meta_image', 'zlib', (meta % ('True', 'CompressedDataSize = %d\n' % len(packed))).encode() + packed)


CORNERS = [(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def meshes():
    text = 'solid body\n'
    binary = bytes(80) + struct.pack('<I', len(FACES))
    for face in FACES:
        text += 'facet normal 0 0 0\nouter loop\n'
        text += ''.join('vertex %g %g %g\n' % CORNERS[corner] for corner in face) + 'endloop\nendfacet\n'
        binary += struct.pack('<12fH', 0, 0, 0, *sum((CORNERS[corner] for corner in face), ()), 0)
    write('mesh', 'stl_text', text + 'endsolid body\n')
    write('mesh', 'stl_binary', binary)
    header = ('ply\nformat %s 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n'
              'element face 4\nproperty list uchar int vertex_indices\nend_header\n')
    write('mesh', 'ply_text', header % 'ascii' + ''.join('%g %g %g\n' % corner for corner in CORNERS) +
          ''.join('3 %d %d %d\n' % face for face in FACES))
    write('mesh', 'ply_binary', (header % 'binary_little_endian').encode() +
          b''.join(struct.pack('<3f', *corner) for corner in CORNERS) +
          b''.join(struct.pack('<B3i', 3, *face) for face in FACES))
    write('mesh', 'vtk_text', '# vtk DataFile Version 3.0\nbody\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n' +
          ''.join('%g %g %g\n' % corner for corner in CORNERS) + 'POLYGONS 4 16\n' +
          ''.join('3 %d %d %d\n' % face for face in FACES))
    write('mesh', 'vtk_binary', b'# vtk DataFile Version 5.1\nbody\nBINARY\nDATASET POLYDATA\nPOINTS 4 float\n' +
          b''.join(struct.pack('>3f', *corner) for corner in CORNERS) +
          b'\nPOLYGONS 5 12\nOFFSETS vtktypeint64\n' + struct.pack('>5q', 0, 3, 6, 9, 12) +
          b'\nCONNECTIVITY vtktypeint64\n' + b''.join(struct.pack('>3q', *face) for face in FACES))


def element(group, number, vr, value):
    if isinstance(value, str):
        value = value.encode()
    if len(value) % 2:
        value += b'\0' if vr in ('UI', 'OB') else b' '
    head = struct.pack('<HH', group, number) + vr.encode()
    if vr in ('OB', 'OW', 'SQ', 'UN'):
        return head + b'\0\0' + struct.pack('<I', len(value)) + value
    return head + struct.pack('<H', len(value)) + value


def us(value):
    return struct.pack('<H', value)


def dicom(sop_class, own):
    """`own`: elements by their tag."""
    elements = {
        (0x08, 0x16): ('UI', sop_class), (0x08, 0x18): ('UI', '1.2.3.4'), (0x20, 0x0d): ('UI', '1.2.3.1'),
        (0x20, 0x0e): ('UI', '1.2.3.2'), (0x20, 0x13): ('IS', '1'), (0x28, 0x02): ('US', us(1)),
        (0x28, 0x04): ('CS', 'MONOCHROME2'), (0x28, 0x10): ('US', us(4)), (0x28, 0x11): ('US', us(4)),
        (0x28, 0x100): ('US', us(16)), (0x28, 0x101): ('US', us(12)), (0x28, 0x102): ('US', us(11)),
        (0x28, 0x103): ('US', us(0)), (0x7fe0, 0x10): ('OW', struct.pack('<16H', *range(100, 116)))}
    elements.update(own)
    meta = (element(2, 1, 'OB', b'\0\1') + element(2, 2, 'UI', sop_class) + element(2, 3, 'UI', '1.2.3.4') +
            element(2, 0x10, 'UI', '1.2.840.10008.1.2.1'))
    meta = element(2, 0, 'UL', struct.pack('<I', len(meta))) + meta
    return bytes(128) + b'DICM' + meta + b''.join(element(*tag, *elements[tag]) for tag in sorted(elements))


def dicoms():
    ct = dicom('1.2.840.10008.5.1.4.1.1.2', {
        (0x08, 0x60): ('CS', 'CT'), (0x20, 0x32): ('DS', '-10\\-20\\5'), (0x20, 0x37): ('DS', '1\\0\\0\\0\\1\\0'),
        (0x28, 0x30): ('DS', '0.5\\0.5'), (0x28, 0x120): ('US', us(0)), (0x28, 0x1052): ('DS', '-1024'),
        (0x28, 0x1053): ('DS', '1')})
    xray = dicom('1.2.840.10008.5.1.4.1.1.12.1', {
        (0x08, 0x60): ('CS', 'XA'), (0x18, 0x1110): ('DS', '1200'), (0x18, 0x1111): ('DS', '800'),
        (0x18, 0x1164): ('DS', '0.2\\0.2'), (0x18, 0x1510): ('DS', '30'), (0x18, 0x1511): ('DS', '-10'),
        (0x18, 0x1600): ('CS', 'RECTANGULAR'), (0x18, 0x1602): ('IS', '1'), (0x18, 0x1604): ('IS', '4'),
        (0x18, 0x1606): ('IS', '1'), (0x18, 0x1608): ('IS', '3'), (0x20, 0x20): ('CS', 'L\\F'),
        (0x28, 0x1040): ('CS', 'LIN'), (0x28, 0x3000): ('SQ', b'')})
    for target in ('dicom_structure', 'dicom_file'):
        write(target, 'ct', ct)
        write(target, 'xray', xray)

    def attribute(place, numbers):
        return struct.pack('<BBB', place, 0, len(numbers)) + struct.pack('<%dd' % len(numbers), *numbers)

    # Places in the table of test/fuzz/dicom_geometry_fuzz.cpp: distances, spacing, angles.
    write('dicom_geometry', 'positioner', struct.pack('<BHHB', 0, 511, 383, 5) + attribute(8, [1200.0]) +
          attribute(9, [800.0]) + attribute(14, [0.2, 0.2]) + attribute(15, [30.0]) + attribute(16, [-10.0]))


def image(encoding, bytes_each, stamp=1.0):
    message = Image()
    message.header.stamp = genpy.Time.from_sec(stamp)
    message.header.frame_id = 'xray'
    message.width, message.height, message.encoding = 12, 10, encoding
    message.step = message.width * bytes_each
    pixels = [30 + (7 * i) % 90 for i in range(120)]
    message.data = {1: bytes(pixels), 2: struct.pack('<120H', *pixels), 4: struct.pack('<120f', *pixels)}[bytes_each]
    return message


def camera_info(distortion, stamp=1.0):
    message = CameraInfo()
    message.header.stamp = genpy.Time.from_sec(stamp)
    message.header.frame_id = 'xray'
    message.width, message.height = 12, 10
    message.K = [500, 0, 5.5, 0, 500, 4.5, 0, 0, 1]
    message.D = distortion
    message.distortion_model = 'plumb_bob'
    return message


def serialised(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def messages():
    for options, encoding, size, distortion in ((28, 'mono8', 1, []), (29, 'mono16', 2, [0.1, 0, 0, 0, 0]),
                                                (30, '32FC1', 4, [])):
        pixels = serialised(image(encoding, size))
        write('image_message', encoding,
              struct.pack('<BH', options, len(pixels)) + pixels + serialised(camera_info(distortion)))


def bags():
    with rosbag.Bag(path('bag_session', 'two_views'), 'w') as bag:
        def record(topic, message, stamp=1.0):
            # Without the texts that say what the messages are, which are longer than all the rest.
            header = {'topic': topic, 'type': message._type, 'md5sum': message._md5sum, 'message_definition': ''}
            bag.write(topic, message, genpy.Time.from_sec(stamp), connection_header=header)

        for view in ('ap', 'lateral'):
            pixels, info = image('mono8', 1), camera_info([])
            pixels.header.frame_id = info.header.frame_id = view + '_optical'
            record('/%s/image_raw' % view, pixels)
            record('/%s/camera_info' % view, info)
            truth = PoseStamped(header=pixels.header)
            truth.pose.orientation.w = 1.0
            record('/%s/ground_truth' % view, truth)
            record('/%s/ground_truth/T12' % view, truth)
        between = TransformStamped()
        between.header.stamp = genpy.Time(1)
        between.header.frame_id, between.child_frame_id = 'ap_optical', 'lateral_optical'
        between.transform.rotation.w = 1.0
        record('/tf_static', TFMessage(transforms=[between]))


for make in (texts, volumes, meshes, dicoms, messages, bags):
    make()

"""Writes small X-rays in DICOM, explicit little endian, with whatever attributes a test needs."""
import struct

XA = '1.2.840.10008.5.1.4.1.1.12.1'
ENHANCED_XA = '1.2.840.10008.5.1.4.1.1.12.1.1'
_LONG = ('OB', 'OW', 'SQ', 'UN')


def _element(group, number, vr, value):
    if vr == 'US':
        body = struct.pack('<H', value)
    elif vr == 'FL':
        body = struct.pack('<%df' % len(value), *value)
    elif vr == 'SQ':
        body = b''.join(struct.pack('<HHI', 0xFFFE, 0xE000, len(item)) + item for item in map(_elements, value))
    elif isinstance(value, bytes):
        body = value
    else:
        body = str(value).encode()
        body += b' ' * (len(body) % 2) if vr != 'UI' else b'\0' * (len(body) % 2)
    head = struct.pack('<HH', group, number) + vr.encode()
    return head + (struct.pack('<HI', 0, len(body)) if vr in _LONG else struct.pack('<H', len(body))) + body


def _elements(attributes):
    return b''.join(_element(group, number, vr, value) for (group, number), (vr, value) in sorted(attributes.items()))


def write(path, rows, attributes, relationship='LIN', modality='XA', photometric='MONOCHROME2', frames=1, kind=XA):
    """rows: lists of 16-bit values; of several frames, one below the other. attributes: {(group, number): (VR, value)} on
    top; of a sequence (SQ) a list of such for its items. kind: the SOP class."""
    height, width = len(rows) // frames, len(rows[0])
    elements = {
        (0x0008, 0x0016): ('UI', kind), (0x0008, 0x0018): ('UI', '1.2.3.' + str(abs(hash(path)) % 10**9)),
        (0x0008, 0x0020): ('DA', '20211124'), (0x0008, 0x0060): ('CS', modality),
        (0x0010, 0x0010): ('PN', 'DOE^JANE'), (0x0010, 0x0020): ('LO', 'ID-4711'), (0x0010, 0x0030): ('DA', '19620317'),
        (0x0028, 0x0002): ('US', 1), (0x0028, 0x0004): ('CS', photometric), (0x0028, 0x0010): ('US', height),
        (0x0028, 0x0011): ('US', width), (0x0028, 0x0100): ('US', 16), (0x0028, 0x0101): ('US', 12),
        (0x0028, 0x0102): ('US', 11), (0x0028, 0x0103): ('US', 0), (0x0028, 0x1040): ('CS', relationship),
        (0x7FE0, 0x0010): ('OW', b''.join(struct.pack('<%dH' % width, *row) for row in rows)),
    }
    if frames > 1:
        elements[0x0028, 0x0008] = ('IS', frames)
    elements.update(attributes)
    meta = b''.join(_element(2, number, vr, value) for number, vr, value in (
        (0x0001, 'OB', b'\0\1'), (0x0002, 'UI', kind), (0x0003, 'UI', '1.2.3'), (0x0010, 'UI', '1.2.840.10008.1.2.1'),
        (0x0012, 'UI', '1.2.3.4')))
    with open(path, 'wb') as file:
        file.write(b'\0' * 128 + b'DICM' + _element(2, 0, 'UL', struct.pack('<I', len(meta))) + meta)
        file.write(_elements(elements))
